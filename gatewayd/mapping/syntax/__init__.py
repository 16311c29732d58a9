"""Rules GW1xx: the text, its structure and its numbers. Found by the readers of text and parts (`source`, `reader`)."""

from __future__ import annotations

from gatewayd.mapping.diagnostics import declare

YAML_SYNTAX = declare("GW101", "yaml-syntax", "the file is not valid YAML")
DUPLICATE_KEY = declare("GW102", "duplicate-key", "a key occurs twice in one mapping")
ALIAS = declare("GW103", "anchor-or-alias", "anchors and aliases are not part of the mapping language")
TAG = declare("GW104", "yaml-tag", "YAML tags are not part of the mapping language")
SEVERAL_DOCUMENTS = declare("GW105", "several-documents", "a mapping file holds one document")
EMPTY = declare("GW106", "empty-file", "the file holds no mapping")
FORMAT_VERSION = declare("GW107", "format-version", "the format version is missing or unknown")
UNKNOWN_KEY = declare("GW108", "unknown-key", "a key that the mapping language does not know")
MISSING_KEY = declare("GW109", "missing-key", "a required key is missing")
WRONG_TYPE = declare(
    "GW110", "wrong-type", "a value of the wrong kind, for example a list in the place of a name"
)
BAD_NUMBER = declare("GW111", "bad-number", "a number written in a form that readers understand differently")
BAD_DURATION = declare("GW112", "bad-duration", "a duration without a unit, or with an unknown one")
BAD_NAME = declare(
    "GW113", "bad-name", "a name with characters that do not survive in tables, logs and PLC tags"
)
BAD_CHOICE = declare("GW114", "bad-choice", "a word that is not among the choices")
OUT_OF_RANGE = declare("GW116", "out-of-range", "a number outside the range of its key")
BAD_NETWORK = declare(
    "GW118", "bad-network-address", "an IP address, a network or a listen address that cannot be read"
)
NOT_UTF8 = declare("GW120", "not-utf8", "the file is not UTF-8 text")
BAD_RANGE = declare(
    "GW122", "bad-range", "a range of registers that runs backwards or leaves the numbered registers"
)
TOO_LARGE = declare("GW123", "too-large", "a file too large or nested too deeply to be a mapping")
