"""Files for Studio 5000 as C: data types, tags and routines are read from what was written, and run by a compiler.

Only what the generated routines use: assignments, COP, SWPB, TONR, IF and FOR. What is none of these does not compile,
and neither does a tag or a member that no file declares.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from xml.etree import ElementTree as ET

from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for

TYPES = {
    "BIT": "uint8_t",
    "BOOL": "uint8_t",
    "SINT": "int8_t",
    "USINT": "uint8_t",
    "INT": "int16_t",
    "UINT": "uint16_t",
    "DINT": "int32_t",
    "UDINT": "uint32_t",
    "LINT": "int64_t",
    "ULINT": "uint64_t",
    "REAL": "float",
    "LREAL": "double",
    "FBD_TIMER": "struct timer",
}
HEAD = """\
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
struct timer { int32_t PRE, ACC; uint8_t TimerEnable, DN; };
#define REVERSE 0
/* One call in 10 ms. */
static inline void tonr(struct timer *timer)
{ timer->ACC = timer->TimerEnable ? timer->ACC + 10 : 0; timer->DN = timer->ACC > timer->PRE; }
#define TONR(timer) tonr(&(timer))
#define COP(from, to, count) memmove(&(to), &(from), (count) * sizeof(to))
#define SWPB(from, how, to) ((to) = (int16_t)__builtin_bswap16((uint16_t)(from)))
#define WHOLE(x) _Generic((x), float: rint(x), double: rint(x), default: (x))
#define SET(to, x) ((to) = _Generic((to), float: (x), double: (x), default: WHOLE(x)))
#define SET_BIT(to, bit, x) ((to) = (int16_t)(((to) & ~(1 << (bit))) | (x ? 1 << (bit) : 0)))
"""
STATEMENTS = (
    (r"^ELSIF (.*) THEN$", r"} else if (\1) {"),
    (r"^IF (.*) THEN$", r"if (\1) {"),
    (r"^FOR (\w+) := (\w+) TO (\w+) DO$", r"for (\1 = \2; \1 <= \3; \1++) {"),
    (r"^ELSE$", "} else {"),
    (r"^END_(IF|FOR);$", "}"),
    (r"^(COP|SWPB|TONR)\((.*)\);$", r"\1(\2);"),
    (r"^(.*\])\.(\d+) := (.*);$", r"SET_BIT(\1, \2, (\3));"),
    (r"^(\S+) := (.*);$", r"SET(\1, (\2));"),
)
EXPRESSIONS = (
    (r"(\w[\w.]*\[\w+\])\.(\d+)\b", r"(\1 >> \2 & 1)"),
    (r"<>", "!="),
    (r"(?<![<>!:=])=(?!=)", "=="),
    (r"\bAND\b", "&&"),
    (r"\bOR\b", "||"),
    (r"\bNOT\b", "!"),
)


def header(model: PlcModel) -> str:
    """A header like that of the target `c`: `gw_unpack` and `gw_pack`, by the routines on the tags."""
    return "\n".join(_lines(model)) + "\n"


def _texts(model: PlcModel) -> dict[str, str]:
    return {
        file.name: file.content().decode().replace("\r\n", "\n") for file in files_for("studio5000", model)
    }


def _declared(files: Mapping[str, str]) -> Iterator[str]:
    """Data types and tags."""
    yield HEAD
    for name in ("Inputs", "Outputs", "Image", "Status"):
        if f"GW_{name}.L5X" in files:
            yield f"struct gw_{name.lower()} {{"
            yield from (f"    {line};" for line in _members(files[f"GW_{name}.L5X"]))
            yield "};"
    yield from (f"{line};" for line in _tags(files["GW_Tags.csv"]))


def _lines(model: PlcModel) -> Iterator[str]:
    files = _texts(model)
    yield from _declared(files)
    for name in ("Unpack", "Pack"):
        yield f"static void routine_{name.lower()}(void)"
        yield "{"
        yield from _statements(routine(files, f"GW_{name}"))
        yield "}"
    yield "static void gw_unpack(const struct gw_image *image, struct gw_outputs *outputs)"
    yield "{ GW_Image = *image; GW_Status.trusted = 1; routine_unpack(); *outputs = GW_Outputs; }"
    yield "static void gw_pack(const struct gw_inputs *inputs, struct gw_image *image)"
    yield "{ GW_Inputs = *inputs; routine_pack(); *image = GW_Image; }"


SHOWN = ("alive", "right_mapping", "trusted", "values_fresh", "robot_writable", "refused_now", "robot_state",
         "program_state", "refusal", "refusal_variable", "fingerprint", "refusals")  # fmt: skip
TABLES = ("good", "quality", "owner")


def watching(model: PlcModel) -> str:
    """A program that reads cycles, 1 with the words of the status block and 0 without, and prints the status."""
    yielded = [*_declared(_texts(model)), "static void routine_watch(void)", "{"]
    yielded += _statements(routine(_texts(model), "GW_Watch"))
    yielded += ["}", "#include <stdio.h>", "int main(void)", "{", "int reads; unsigned word;"]
    yielded += ['while (scanf("%d", &reads) == 1) {', "if (reads) {"]
    for poll in model.status:
        place = f"GW_Image.{poll.name}[i] = (int16_t)word"
        yielded.append(
            f'for (int i = 0; i < {poll.count}; i++) {{ if (scanf("%x", &word) != 1) return 1; {place}; }}'
        )
    yielded += ["}", "routine_watch();"]
    yielded += [f'printf("%d ", (int)GW_Status.{name});' for name in SHOWN]
    for name in TABLES:
        count = len(model.variables)
        yielded.append(f'for (int i = 1; i <= {count}; i++) printf("%d ", (int)GW_Status.{name}[i]);')
    yielded += ['printf("\\n");', "}", "return 0;", "}"]
    return "\n".join(yielded) + "\n"


def _members(text: str) -> Iterator[str]:
    for member in ET.fromstring(text).iter("Member"):  # noqa: S314 - a file of ours
        if member.get("Hidden") == "false":
            count = int(member.get("Dimension", "0"))
            kind = TYPES[member.get("DataType", "")]
            yield f"{kind} {member.get('Name')}{f'[{count}]' if count else ''}"


def _tags(text: str) -> Iterator[str]:
    for row in csv.reader(text.splitlines()):
        if row[0] == "TAG":
            kind, _, dimension = row[4].partition("[")
            size = f"[{dimension}" if dimension else ""
            known = TYPES.get(kind)
            if known is not None:
                yield f"{known} {row[2]}{size}"
            elif kind in ("GW_Inputs", "GW_Outputs", "GW_Image", "GW_Status"):
                yield f"struct {kind.lower()} {row[2]}"


def routine(files: Mapping[str, str], name: str) -> list[str]:
    """The lines of a routine, as its file has them."""
    root = ET.fromstring(files[f"{name}.L5X"])  # noqa: S314 - a file of ours
    return [line.text or "" for line in root.iter("Line")]


def _statements(lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        for statement in re.sub(r"( THEN|;) (?=\S)", r"\1\n", line.strip()).split("\n"):
            if not statement.startswith("//"):
                yield _statement(statement)


def _statement(text: str) -> str:
    for pattern, replacement in STATEMENTS:
        if re.match(pattern, text):
            is_bit = replacement.startswith("SET_BIT")
            condition = re.sub(pattern, replacement, text)
            return condition if is_bit else _expression(condition)
    raise AssertionError(text)


def _expression(text: str) -> str:
    if text.startswith("for"):
        return text
    for pattern, replacement in EXPRESSIONS:
        text = re.sub(pattern, replacement, text)
    return text
