"""Whether a target can hold the names and types of a cell. What it cannot hold is refused, never altered."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from gatewayd.links.exports import ExportError
from gatewayd.plc.model import CellModel, TagFamily
from gatewayd.plc.tags import split_name
from gatewayd.report.format import counted

_NAME = re.compile(r"[A-Za-z](_?[A-Za-z0-9])*")
_SHOWN = 10
_LONGEST_PREFIX = 6
"""So that no generated name has more than 32 characters."""
_WIDE_INTEGERS = frozenset({"LINT", "ULINT"})
_WIDE = frozenset({*_WIDE_INTEGERS, "LREAL"})


@dataclass(frozen=True, slots=True)
class Holds:
    """What an engineering tool can hold."""

    tool: str
    longest: int
    """Characters of a name."""
    keywords: frozenset[str]
    """In small letters."""
    missing: frozenset[str] = frozenset()
    """Types that small controllers of it do not have."""
    small: str = ""
    """Which controllers these are, in words."""


def refuse_unfit(model: CellModel, holds: Holds, *, small: bool) -> None:
    """Raises ExportError with all that the target cannot hold, and the remedy of each."""
    if not (model.inputs or model.outputs):
        why = "; ".join(model.left_out)
        raise ExportError(f"there is nothing for this PLC to read or to write{': ' if why else ''}{why}")
    found = [*_names(model, holds), *_types(model, holds, small=small)]
    if found:
        more = [f"and {len(found) - _SHOWN} more"] if len(found) > _SHOWN else []
        raise ExportError("\n".join([*found[:_SHOWN], *more]))


def _names(model: CellModel, holds: Holds) -> Iterator[str]:
    if not _NAME.fullmatch(model.prefix) or len(model.prefix) > _LONGEST_PREFIX:
        yield f"`{model.prefix}` is no prefix: --prefix takes a letter, then up to 5 letters, digits and single `_`"
    known: dict[str, str] = {}
    for name, family in {family.name: family for family in (*model.inputs, *model.outputs)}.items():
        problem = _problem(name, holds)
        if not problem and known.setdefault(name.lower(), name) != name:
            problem = f"differs from `{known[name.lower()]}` in capitals only"
        if problem:
            yield f"`{name}` {problem}: {_remedy(name, split_name(family.tags[0].name)[0])}"


def _remedy(name: str, original: str) -> str:
    """A name of --name is not in the mapping: only another --name helps, for what it is called there."""
    called = f"--name {original}=NAME"
    if name != original:
        return f"`{original}` of the mapping needs another name here: {called}"
    return f"rename it in the mapping, or call it otherwise here: {called}"


def _problem(name: str, holds: Holds) -> str:
    if len(name) > holds.longest:
        return f"has {counted(len(name), 'character')}, {holds.tool} takes {holds.longest}"
    if name.lower() in holds.keywords:
        return f"is a word of {holds.tool}'s language"
    return "" if _NAME.fullmatch(name) else "is no name in IEC 61131-3: no double `_`, none at the end"


def _types(model: CellModel, holds: Holds, *, small: bool) -> Iterator[str]:
    if not small:
        return
    for member in (*model.inputs, *model.outputs):
        for used in sorted({member.type, *(tag.arithmetic for tag in member.tags)} & holds.missing):
            yield f"`{member.name}` is {used}, which {holds.small} do not have: {_narrower(member, used)}"


def _narrower(member: TagFamily, used: str) -> str:
    first = member.tags[0]
    called = {name: f"`type: {first.type_in_mapping(name)}`" for name in ("int16", "int32", "float32")}
    if used not in _WIDE:
        return f"give its place a type with a sign: {called['int16']} or {called['int32']}"
    if used in _WIDE_INTEGERS:
        return f"give its place {called['int32']}"
    if first.encoding is not None and first.encoding.is_scaled:
        return f"give its place {called['float32']} without a scale, or {called['int16']} with one"
    return f"give its place {called['float32']}"
