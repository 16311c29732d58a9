"""Structured text as plain text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from gatewayd.plc.st.program import (
    DataType,
    Enumeration,
    PlcVariable,
    ProgramUnit,
    Structure,
    TypeName,
    VariableSection,
    indented,
)


def comment(text: str) -> str:
    """A comment: what would end it is set apart."""
    return f"(* {text.replace('*)', '* )').replace('(*', '( *')} *)" if text else ""


def type_text(name: TypeName) -> str:
    """`ARRAY[0..5] OF REAL`."""
    if name.is_pointer:
        return f"POINTER TO {name.name}"
    return name.name if name.last is None else f"ARRAY[{name.first}..{name.last}] OF {name.name}"


def data_type_source(kind: DataType) -> list[str]:
    """A declaration with TYPE and END_TYPE."""
    head = [comment(kind.comment)] if kind.comment else []
    return [*head, "TYPE", f"{kind.name} :", *_definition(kind), "END_TYPE"]


def _definition(kind: DataType) -> list[str]:
    if isinstance(kind, Structure):
        return ["STRUCT", *indented([field_source(field) for field in kind.fields]), "END_STRUCT;"]
    return enumeration_lines(kind)


def enumeration_lines(kind: Enumeration) -> list[str]:
    """The names in brackets."""
    last = len(kind.literals) - 1
    lines = [
        f"{name}{',' if number < last else ''} {comment(f'{number}: {text}' if text else str(number))}"
        for number, (name, text) in enumerate(kind.literals)
    ]
    return ["(", *indented(lines), ");"]


def field_source(field: PlcVariable) -> str:
    """`name : INT := 3; (* comment *)`."""
    initial = f" := {field.initial}" if field.initial else ""
    place = f" AT {field.address}" if field.address else ""
    return f"{field.name}{place} : {type_text(field.type)}{initial}; {comment(field.comment)}".rstrip()


def section_source(section: VariableSection) -> list[str]:
    """Variables between their keywords."""
    return [section.keyword, *indented([field_source(field) for field in section.fields]), "END_VAR"]


def declaration(unit: ProgramUnit) -> list[str]:
    """The head of a block and its variables."""
    result = f" : {unit.result}" if unit.result else ""
    head = [comment(unit.comment)] if unit.comment else []
    sections = [line for section in unit.sections if section.fields for line in section_source(section)]
    return [*head, f"{unit.keyword} {unit.name}{result}", *sections]


def unit_source(unit: ProgramUnit) -> list[str]:
    """All of a block."""
    return [*declaration(unit), "", *indented(unit.body), f"END_{unit.keyword}"]


def text_of(header: Sequence[str], parts: Iterable[list[str]]) -> str:
    """A file: its header as comments, then the parts with an empty line between them."""
    return "\n".join(_lines(header, parts)) + "\n"


def _lines(header: Sequence[str], parts: Iterable[list[str]]) -> Iterator[str]:
    yield from map(comment, header)
    for part in parts:
        yield ""
        yield from part
