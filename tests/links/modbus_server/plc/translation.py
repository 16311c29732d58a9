"""Structured text as C, statement by statement: so that a compiler runs the very lines that a PLC gets.

Only what the generated blocks use: assignments, calls with named operands, IF, WHILE, and the standard's conversions. A
statement that is none of these does not compile.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

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
    (r"\b(image|inputs|outputs|from_node|to_node)\.", r"\1->"),
    (r"\bdouble\b", "double_"),
)


@dataclass(frozen=True, slots=True)
class TranslatedBlock:
    """A block that becomes a function with these operands; `declared`: what else it knows, as C."""

    unit: ProgramUnit
    operands: str
    declared: Sequence[str]


def header(model: PlcModel) -> str:
    """A header like that of the target `c`: structures, `gw_unpack` and `gw_pack`."""
    image = "struct gw_image *image"
    blocks = (
        TranslatedBlock(unpack(model, DIALECT), f"{image}, struct gw_outputs *outputs", UNPACKING),
        TranslatedBlock(pack(model, DIALECT), f"struct gw_inputs *inputs, {image}", PACKING),
    )
    return translated(data_types(model, DIALECT), functions(model, DIALECT), blocks)


UNPACKING = ("const bool trusted = true;", "bool unreadable;")
PACKING = ("bool clipped;",)
WANTED = frozenset({"GW_Inputs", "GW_Outputs", "GW_Image", "GW_FromNode", "GW_ToNode"})


def translated(
    types: Iterable[object], units: Iterable[ProgramUnit], blocks: Iterable[TranslatedBlock]
) -> str:
    """A header with the structures of values and images, the functions, and the blocks as functions."""
    return "\n".join(_lines(types, units, blocks)) + "\n"


def _lines(
    types: Iterable[object], units: Iterable[ProgramUnit], blocks: Iterable[TranslatedBlock]
) -> Iterator[str]:
    yield HEAD
    for source, old in TYPES.items():
        for target, new in TYPES.items():
            rounded = "rint" if source.endswith("REAL") and not target.endswith("REAL") else ""
            yield f"#define {source}_TO_{target}(x) (({new}){rounded}(({old})(x)))"
    for kind in types:
        if isinstance(kind, Structure) and kind.name in WANTED:
            yield f"struct {re.sub('(?<=[a-z])(?=[A-Z])', '_', kind.name).lower()} {{"
            yield from (f"    {_declared(field)};" for field in kind.fields)
            yield "};"
    for unit in units:
        yield from _function(unit)
    for block in blocks:
        yield from _block(block)


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


def _block(block: TranslatedBlock) -> Iterator[str]:
    yield f"static void {block.unit.name.lower()}({block.operands})"
    yield "{"
    yield from block.declared
    yield from (f"    {_declared(field)};" for field in block.unit.sections[-1].fields)
    yield from _statements(block.unit.body)
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
