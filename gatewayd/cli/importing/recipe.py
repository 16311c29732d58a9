"""What of RTDE recipes a mapping can carry, and the mapping that carries it. Pure: recipes in, text out."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from gatewayd.cli.importing.findings import FindingKind, ImportFinding
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipes import DeclaredField, DeclaredRecipe
from gatewayd.rtde.recipes.declared import OUTPUT_KEY
from gatewayd.rtde.types import DataType

_OUTPUTS_FROM = 1000
"""First register of what comes from the robot; all inputs that there are need fewer."""
_REGISTERS = {"?": 1, "B": 1, "I": 2, "i": 2, "Q": 4, "d": 4}
"""`DataType.code` -> registers of an element, with the type that a mapping gives it by itself."""
_SINGLE = 2
_REGISTER = "_register"
"""In the names of general purpose registers, of which the catalogue has nothing to tell about this one."""
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*|[0-9]{1,3}(?:\.[0-9]{1,3}){3}(?::[0-9]+)?")


@dataclass(frozen=True, slots=True)
class ImportedField:
    """A field that becomes a variable."""

    name: str
    type: DataType
    is_input: bool
    in_guides: bool
    """Otherwise the mapping has to declare its type."""


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What no recipe says of a cell."""

    cell: str
    host: str
    listen: str
    writer: str | None = None
    """Address of the one Modbus client that may write the inputs; None: there are none."""
    frequency: float | None = None
    series: str | None = None
    version: str | None = None
    single: bool = False
    """Reals as float32 with two registers, where the exact float64 takes four."""


def imported(
    recipes: Sequence[DeclaredRecipe],
) -> tuple[tuple[ImportedField, ...], tuple[ImportFinding, ...]]:
    """The variables, inputs first, each once, and what there is to say about the others; by line."""
    fields: dict[str, ImportedField] = {}
    findings: list[ImportFinding] = []
    for recipe in sorted(recipes, key=lambda recipe: not is_input_recipe(recipe)):
        as_input = is_input_recipe(recipe)
        for field in recipe.fields:
            text = _objection(field, recipe, fields, as_input=as_input)
            if text:
                findings.append(ImportFinding(field.line, 0, text, file=recipe.file))
                continue
            found = _field(field, as_input=as_input)
            if field.type is not None and found.in_guides and field.type is not found.type:
                words = f"declared as {field.type.word}; the mapping takes {found.type.word}, as the guides"
                note = f"{field.name} is {words}"
                findings.append(ImportFinding(field.line, 0, note, FindingKind.NOTE, file=recipe.file))
            fields.setdefault(field.name, found)
    ordered = sorted(fields.values(), key=lambda field: not field.is_input)
    return tuple(ordered), tuple(sorted(findings, key=lambda finding: finding.line))


def is_input_recipe(recipe: DeclaredRecipe) -> bool:
    """Whether a client sends this recipe. No file says so: its fields do, and its key where they can be both."""
    names = set(recipe.names)
    if names & (set(OUTPUTS) - set(INPUTS)):
        return False
    if names & (set(INPUTS) - set(OUTPUTS)):
        return True
    return bool(names & set(INPUTS)) and (recipe.key != OUTPUT_KEY or not recipe.types)


def _objection(
    field: DeclaredField, recipe: DeclaredRecipe, fields: Mapping[str, ImportedField], *, as_input: bool
) -> str:
    """Why a field cannot be carried, and what to do; empty if it can."""
    name = field.name
    mask = COMPANIONS[name].mask if as_input and name in COMPANIONS else None
    if mask is not None and mask not in recipe.names:
        return f"{name} has no effect without {mask}, which the recipe lacks; add it, or strike the field"
    if as_input and name not in INPUTS:
        return f"{name} is no input of the guides; a mapping cannot write it: strike it"
    if as_input or name in fields:
        return ""
    if name in INPUTS and name in OUTPUTS:
        return (
            f"{name} is read back by the recipe {recipe.key!r}, but no recipe writes it; a mapping has inputs only to "
            "write them: strike it, or put it into a recipe of inputs"
        )
    if name in INPUTS:
        return f"{name} is an input among outputs, which no controller sends; put it into a recipe of its own"
    if name not in OUTPUTS and field.type is None:
        return (
            f"{name} is in no guide, and its type is not declared; strike it, or import it from an XML recipe"
        )
    return ""


def _field(field: DeclaredField, *, as_input: bool) -> ImportedField:
    known = (INPUTS if as_input else OUTPUTS).get(field.name) or INPUTS.get(field.name)
    if known is not None:
        return ImportedField(field.name, known.type, field.name in INPUTS, in_guides=True)
    assert field.type is not None
    return ImportedField(field.name, field.type, is_input=False, in_guides=False)


def mapping_text(fields: Sequence[ImportedField], settings: ImportSettings, source: str) -> str:
    """The mapping file. Registers in the order of the recipes: inputs from 0, what the robot sends from 1000."""
    return "\n".join([*_head(settings, source), "", "variables:", *_variables(fields, settings)]) + "\n"


def _head(settings: ImportSettings, source: str) -> Iterator[str]:
    yield f"# Made by `gatewayd import rtde` from {json.dumps(source)}, in the order of its fields."
    yield f"# Towards the robot: from register 0 on. From the robot: from register {_OUTPUTS_FROM} on."
    yield ""
    yield "gatewayd: 1"
    yield f"cell: {_quoted(settings.cell)}"
    yield ""
    yield "robot:"
    yield f"  host: {_quoted(settings.host)}"
    if settings.series is not None:
        yield f"  series: {settings.series}"
    if settings.version is not None:
        yield f"  version: {json.dumps(settings.version)}"
    if settings.frequency is not None:
        yield f"  frequency: {settings.frequency:g}"
    yield ""
    yield "modbus:"
    yield f"  listen: {_quoted(settings.listen)}"
    if settings.writer is not None:
        yield f"  allow: [{_quoted(settings.writer)}]"
        yield ""
        yield "writers:"
        yield f"  plc: {{modbus: {_quoted(settings.writer)}, timeout: 1s}}"


def _variables(fields: Sequence[ImportedField], settings: ImportSettings) -> Iterator[str]:
    register = {True: 0, False: _OUTPUTS_FROM}
    for field in fields:
        single = settings.single and field.type.code == "d"
        place = register[field.is_input]
        register[field.is_input] += (_SINGLE if single else _REGISTERS[field.type.code]) * field.type.count
        robot = field.name if field.in_guides else f"{{field: {field.name}, type: {field.type.word}}}"
        parts = [
            f"robot: {robot}",
            f"modbus: {{holding: {place}, type: float32}}" if single else f"modbus: {place}",
            *(("owner: plc", "on_release: clear") if field.is_input else ()),
            *_described(field),
        ]
        yield f"  {field.name}: {{{', '.join(parts)}}}"


def _described(field: ImportedField) -> Iterator[str]:
    known = (INPUTS if field.is_input else OUTPUTS).get(field.name)
    if known is not None:
        if known.unit:
            yield f"unit: {json.dumps(known.unit, ensure_ascii=False)}"
        if _REGISTER not in field.name:
            yield f"comment: {json.dumps(known.comment, ensure_ascii=False)}"


def _quoted(text: str) -> str:
    """A text as YAML takes it for one."""
    return text if _PLAIN.fullmatch(text) else json.dumps(text)
