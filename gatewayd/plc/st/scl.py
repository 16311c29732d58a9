"""Structured text as an external source of TIA Portal (SCL)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from gatewayd.plc.st.program import (
    DataType,
    PlcVariable,
    ProgramUnit,
    Structure,
    TypeName,
    VariableSection,
    indented,
)

_LIBRARY: Final = {"TON": "TON_TIME"}
"""Blocks of the standard under the names that they have there."""


def note(text: str) -> str:
    """A comment to the end of the line: TIA Portal keeps it at the member."""
    return f"// {text}" if text else ""


def type_source(kind: DataType) -> list[str]:
    """A PLC data type."""
    assert isinstance(kind, Structure)
    fields = indented([_field(field) for field in kind.fields], 2)
    return [
        f'TYPE "{kind.name}"',
        *filter(None, [note(kind.comment)]),
        "VERSION : 0.1",
        "  STRUCT",
        *fields,
        "  END_STRUCT;",
        "END_TYPE",
    ]


def unit_source(unit: ProgramUnit) -> list[str]:
    """A function or a function block."""
    result = f" : {unit.result}" if unit.result else ""
    return [
        f'{unit.keyword} "{unit.name}"{result}',
        *filter(None, [note(unit.comment)]),
        "VERSION : 0.1",
        *(line for section in unit.sections if section.fields for line in _section(unit, section)),
        "BEGIN",
        *indented(unit.body),
        f"END_{unit.keyword}",
    ]


def data_block(name: str, fields: Iterable[PlcVariable]) -> list[str]:
    """A global data block with standard access, in which the client may place what it reads."""
    return [
        f'DATA_BLOCK "{name}"',
        "{ S7_Optimized_Access := 'FALSE' }",
        "VERSION : 0.1",
        "NON_RETAIN",
        "  STRUCT",
        *indented([_field(field) for field in fields], 2),
        "  END_STRUCT;",
        "BEGIN",
        "END_DATA_BLOCK",
    ]


def _section(unit: ProgramUnit, section: VariableSection) -> Sequence[str]:
    keyword = "VAR_TEMP" if unit.keyword == "FUNCTION" and section.keyword == "VAR" else section.keyword
    return [keyword, *indented([_field(field) for field in section.fields]), "END_VAR"]


def _field(field: PlcVariable) -> str:
    initial = f" := {field.initial}" if field.initial else ""
    return f"{field.name} : {_type(field.type)}{initial}; {note(field.comment)}".rstrip()


def _type(name: TypeName) -> str:
    base = f'"{name.name}"' if name.is_own else _LIBRARY.get(name.name, name.name)
    return base if name.last is None else f"Array[{name.first}..{name.last}] of {base}"
