"""Rules GW1xx: the text, its structure and its numbers. Declared here, found by the loader."""

from __future__ import annotations

from gatewayd.mapping.diagnostics import declare

__all__ = [
    "ALIAS",
    "BAD_ADDRESS",
    "BAD_CHOICE",
    "BAD_COB_ID",
    "BAD_DURATION",
    "BAD_NAME",
    "BAD_NETWORK",
    "BAD_NUMBER",
    "BAD_RANGE",
    "BAD_REFERENCE",
    "DUPLICATE_KEY",
    "EMPTY",
    "FORMAT_VERSION",
    "MISSING_KEY",
    "NOT_UTF8",
    "OUT_OF_RANGE",
    "SEVERAL_DOCUMENTS",
    "TAG",
    "TOO_LARGE",
    "UNKNOWN_KEY",
    "WRONG_TYPE",
    "YAML_SYNTAX",
]

YAML_SYNTAX = declare(
    "GW101",
    "yaml-syntax",
    "the file is not valid YAML",
    """
The text could not be read as YAML, so nothing behind this place was checked. The usual causes are a tab
used for indentation, a bracket or a quote that is never closed, and a `:` without a space behind it.
""",
)
DUPLICATE_KEY = declare(
    "GW102",
    "duplicate-key",
    "a key occurs twice in one mapping",
    """
Most YAML readers silently keep the last of two equal keys: a variable pasted twice would lose its first
definition without a word. Rename one of the two, or delete it.
""",
)
ALIAS = declare(
    "GW103",
    "anchor-or-alias",
    "anchors and aliases are not part of the mapping language",
    """
`&name` and `*name` make a line mean something that is written elsewhere. A mapping is read in a diff and
at 3 a.m., so every line says what it means itself. Write the value out; many equal variables are best
written as a range (`output_double_register_0..23`).
""",
)
TAG = declare(
    "GW104",
    "yaml-tag",
    "YAML tags are not part of the mapping language",
    """
A tag (`!!int`, `!custom`) changes how a value is read. The mapping language decides types by the key
alone. Remove the tag.
""",
)
SEVERAL_DOCUMENTS = declare(
    "GW105",
    "several-documents",
    "a mapping file holds one document",
    """
A `---` in the middle of a file starts a second YAML document, which would be ignored. One file describes
one robot cell; write a second file and name both on the command line.
""",
)
EMPTY = declare(
    "GW106",
    "empty-file",
    "the file holds no mapping",
    """
The file is empty or holds only comments. The smallest mapping has `gatewayd: 1`, a `cell` name, `robot:
{host: ...}` and one variable.
""",
)
FORMAT_VERSION = declare(
    "GW107",
    "format-version",
    "the format version is missing or unknown",
    """
`gatewayd: 1` in the first lines says which version of the mapping language the file is written in, so
that a later gatewayd can never read an old file with a new meaning.
""",
)
UNKNOWN_KEY = declare(
    "GW108",
    "unknown-key",
    "a key that the mapping language does not know",
    """
A misspelt key would be ignored and its default would act instead: `on_relase: hold` would clear. So
unknown keys are errors. The message names the nearest known key; editors complete keys with the JSON
Schema (`# yaml-language-server: $schema=...`).
""",
)
MISSING_KEY = declare(
    "GW109",
    "missing-key",
    "a required key is missing",
    """
The section cannot be understood without this key, and there is no default that could be right for every
cell.
""",
)
WRONG_TYPE = declare(
    "GW110",
    "wrong-type",
    "a value of the wrong kind, for example a list in the place of a name",
    """
The key is known, but what stands behind it has another shape: text in the place of a number, a list in
the place of a mapping, nothing at all. YAML makes this easy to do by wrong indentation.
""",
)
BAD_NUMBER = declare(
    "GW111",
    "bad-number",
    "a number written in a form that readers understand differently",
    """
`010` is 8 to some YAML readers and 10 to others; `1E3`, `22:30`, `0x10`, `1_000` and `0.10` have similar
histories. The mapping language takes plain decimal integers, plain decimal fractions where a fraction
makes sense, and nothing else; CAN identifiers alone are hexadecimal (`0x1A0`).
""",
)
BAD_DURATION = declare(
    "GW112",
    "bad-duration",
    "a duration without a unit, or with an unknown one",
    """
`timeout: 5` is five seconds to one reader and five milliseconds to the next. A duration always names its
unit: `500ms`, `2s`, `1.5s`, `5min`.
""",
)
BAD_NAME = declare(
    "GW113",
    "bad-name",
    "a name with characters that do not survive in tables, logs and PLC tags",
    """
Names of cells, writers, groups and variables appear in logs, CSV tables and PLC tag lists. They start
with a letter and go on with letters, digits and `_` (in a cell's name: small letters, digits and `-`).
""",
)
BAD_CHOICE = declare(
    "GW114",
    "bad-choice",
    "a word that is not among the choices",
    """
The key takes one of a few words. The message lists them and names the nearest.
""",
)
BAD_ADDRESS = declare(
    "GW115",
    "bad-address",
    "a Modbus address that cannot be read",
    """
A place is a register (`100`), a bit of a register (`100.3`, bits 0 to 15, bit 0 is the least significant)
or an area with an address (`{coil: 5}`, `{discrete: 5}`, `{input: 5}`, `{holding: 100, type: int16}`).
Addresses are protocol addresses, decimal, from 0.
""",
)
OUT_OF_RANGE = declare(
    "GW116",
    "out-of-range",
    "a number outside the range of its key",
    """
The key takes a number within fixed bounds: a TCP port 1 to 65535, a number of connections of at least 1,
and so on.
""",
)
BAD_REFERENCE = declare(
    "GW117",
    "bad-robot-reference",
    "a `robot:` reference that cannot be read",
    """
A reference is an RTDE field (`actual_TCP_pose`), an element of a vector (`actual_TCP_pose[0]`), a bit of
an integer field (`actual_digital_input_bits.3`), or a range of numbered registers
(`output_double_register_0..23`).
""",
)
BAD_NETWORK = declare(
    "GW118",
    "bad-network-address",
    "an IP address, a network or a listen address that cannot be read",
    """
Peers are named by address (`192.168.1.20`) or network (`192.168.1.0/28`, no host bits set); a listener by
host and port (`127.0.0.1:1502`, `[::1]:502`). Names are not resolved here: a writer's rights must not
hang on a name server.
""",
)
NOT_UTF8 = declare(
    "GW120",
    "not-utf8",
    "the file is not UTF-8 text",
    """
The file holds bytes that are not UTF-8, or control characters. Editors on Windows may have saved it as
UTF-16 or in a national code page: save it as UTF-8.
""",
)
BAD_COB_ID = declare(
    "GW121",
    "bad-cob-id",
    "a COB-ID that cannot be read",
    """
COB-IDs are written with `0x` and hexadecimal digits (`0x1A0`), as every CANopen manual and every bus monitor
shows them, and several of them as a range (`0x1A0..0x1AF`). `180` might mean 180h to one reader and B4h to
the next. They have 11 bits: the greatest is 0x7FF.
""",
)
BAD_RANGE = declare(
    "GW122",
    "bad-range",
    "a range of registers that runs backwards or leaves the numbered registers",
    """
`output_double_register_0..23` names registers 0 to 23, both included. The second number must not be less
than the first, and both registers must exist (bits 0 to 127, integers and doubles 0 to 47).
""",
)
TOO_LARGE = declare(
    "GW123",
    "too-large",
    "a file too large or nested too deeply to be a mapping",
    """
A full image of a controller is a few kilobytes of YAML. A file far beyond that, or nested dozens of
levels deep, is not a mapping, and reading it could take the machine down.
""",
)
