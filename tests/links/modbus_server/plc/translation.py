"""Structured text as C, statement by statement: so that a compiler runs the very lines that a PLC gets.

Only what the generated blocks use: assignments, calls with named operands, IF, WHILE, and the standard's conversions. A
statement that is none of these does not compile.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.st.decode import unpack
from gatewayd.links.modbus_server.plc.st.encode import pack
from gatewayd.links.modbus_server.plc.st.types import data_types
from gatewayd.links.modbus_server.plc.targets.iec_st import DIALECT
from gatewayd.plc.st.convert import functions
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, Structure, TypeName

TYPES = {
    "BOOL": "bool",
    "SINT": "int8_t",
    "USINT": "uint8_t",
    "BYTE": "uint8_t",
    "INT": "int16_t",
    "UINT": "uint16_t",
    "WORD": "uint16_t",
    "DINT": "int32_t",
    "UDINT": "uint32_t",
    "DWORD": "uint32_t",
    "LINT": "int64_t",
    "ULINT": "uint64_t",
    "LWORD": "uint64_t",
    "REAL": "float",
    "LREAL": "double",
}
HEAD = """\
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#define SHL(x, n) ((__typeof__(x))((x) << (n)))
#define SHR(x, n) ((__typeof__(x))((x) >> (n)))
#define ROL(x, n) ((uint16_t)((x) << (n) | (x) >> (16 - (n))))
#define ABS(x) ((__typeof__(x))fabs(x))
"""
STATEMENTS = (
    (r"^ELSIF (.*) THEN$", r"} else if (\1) {"),
    (r"^IF (.*) THEN$", r"if (\1) {"),
    (r"^WHILE (.*) DO$", r"while (\1) {"),
    (r"^ELSE$", "} else {"),
    (r"^END_(IF|WHILE);$", "}"),
)
EXPRESSIONS = (
    (r"\b(?:BYTE|WORD|DWORD|LWORD)#16#([0-9A-F]+)", r"0x\1u"),
    (r"\bLREAL#(-?[0-9.]+(?:E-?[0-9]+)?)", r"(\1)"),
    (r"\bREAL#(-?[0-9.]+(?:E-?[0-9]+)?)", r"(\1f)"),
    (r"(?<=[(,] )?\b(?:value|bits|high|low|[abcd]) := ", ""),
    (r"<>", "!="),
    (r"(?<![<>!:=])=(?!=)", "=="),
    (r"\bAND\b", "&"),
    (r"\bOR\b", "|"),
    (r"\bNOT\b", "!"),
    (r"\bTRUE\b", "1"),
    (r"\bFALSE\b", "0"),
    (r"\b(image|inputs|outputs)\.", r"\1->"),
    (r"\bdouble\b", "double_"),
)


def header(model: PlcModel) -> str:
    """A header like that of the target `c`: structures, `gw_unpack` and `gw_pack`."""
    return "\n".join(_lines(model)) + "\n"


def _lines(model: PlcModel) -> Iterator[str]:
    yield HEAD
    for source, old in TYPES.items():
        for target, new in TYPES.items():
            rounded = "rint" if source.endswith("REAL") and not target.endswith("REAL") else ""
            yield f"#define {source}_TO_{target}(x) (({new}){rounded}(({old})(x)))"
    for kind in data_types(model, DIALECT):
        if isinstance(kind, Structure) and kind.name in ("GW_Inputs", "GW_Outputs", "GW_Image"):
            yield f"struct {kind.name.lower()} {{"
            yield from (f"    {_declared(field)};" for field in kind.fields)
            yield "};"
    for unit in functions(model, DIALECT):
        yield from _function(unit)
    image, trusted = "struct gw_image *image", "const bool trusted = true;"
    yield from _block(
        unpack(model, DIALECT), f"{image}, struct gw_outputs *outputs", [trusted, "bool unreadable;"]
    )
    yield from _block(pack(model, DIALECT), f"struct gw_inputs *inputs, {image}", ["bool clipped;"])


def _function(unit: ProgramUnit) -> Iterator[str]:
    operands, *local = unit.sections
    yield f"static {TYPES[unit.result]} {unit.name}({', '.join(map(_declared, operands.fields))})"
    yield "{"
    yield f"    {TYPES[unit.result]} {unit.name}_result;"
    yield from (f"    {_declared(field)};" for section in local for field in section.fields)
    yield from _statements(
        re.sub(rf"\b{unit.name} := ", f"{unit.name}_result := ", line) for line in unit.body
    )
    yield f"    return {unit.name}_result;"
    yield "}"


def _block(unit: ProgramUnit, operands: str, declared: list[str]) -> Iterator[str]:
    yield f"static void {unit.name.lower()}({operands})"
    yield "{"
    yield from declared
    yield from (f"    {_declared(field)};" for field in unit.sections[-1].fields)
    yield from _statements(unit.body)
    yield "}"


def _declared(field: PlcVariable) -> str:
    size = f"[{field.type.count}]" if field.type.last is not None else ""
    return f"{_type(field.type)} {_expression(field.name)}{size}"


def _type(name: TypeName) -> str:
    return TYPES[name.name]


def _statements(lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        for statement in re.sub(r"( THEN|;) (?=\S)", r"\1\n", line.strip()).split("\n"):
            yield _statement(statement)


def _statement(text: str) -> str:
    for pattern, replacement in STATEMENTS:
        if re.match(pattern, text):
            condition = re.sub(pattern, replacement, text)
            return _expression(condition)
    target, assigned, value = text.partition(" := ")
    assert assigned, text
    return f"{_expression(target)} = {_expression(value)}"


def _expression(text: str) -> str:
    for pattern, replacement in EXPRESSIONS:
        text = re.sub(pattern, replacement, text)
    return text
