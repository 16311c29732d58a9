"""From variables of a cell to tags: names, families, owners, and which writer of the mapping the PLC is."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, TypedDict, TypeVar

from gatewayd.core.definition import CellDefinition, Fallback, Limits, ValueKind, Variable
from gatewayd.links.exports import ExportError
from gatewayd.plc.model import Encoding, Tag, TagFamily
from gatewayd.plc.numbers import value_type
from gatewayd.report.printable import printable
from gatewayd.report.wording import alternatives, did_you_mean

NOBODY: Final = "none"
"""The writer of a program that only reads."""
_Tag = TypeVar("_Tag", bound=Tag)


@dataclass(frozen=True, slots=True)
class PlcWishes:
    """What a mapping cannot say of the program."""

    writer: str | None = None
    """Which writer of the mapping the PLC is; `NOBODY`: it only reads; None: the only one there is."""
    prefix: str = "GW"
    names: Mapping[str, str] = field(default_factory=dict)
    """Variable or family of the mapping -> what it is called in the PLC."""
    host: str | None = None
    """How the PLC reaches the gateway; None: at the address where it listens, if it is one."""
    handshake: str | None = None
    """`TOGGLE:ACKNOWLEDGE`, by which a self test is led; None: without self test."""


def owners(variable: Variable, cell: CellDefinition) -> tuple[int, ...]:
    """Writers that may own it; none of an output."""
    return () if variable.lock is None else cell.locks[variable.lock].owners


class TagKeys(TypedDict):
    """What a tag has of its variable, on whatever link (`Tag`)."""

    number: int
    name: str
    member: str
    element: int | None
    kind: ValueKind
    type: str
    arithmetic: str
    encoding: Encoding | None
    unit: str
    comment: str
    limits: Limits | None
    on_stale: Fallback
    owners: tuple[int, ...]


def tag_keys(variable: Variable, cell: CellDefinition, encoding: Encoding | None) -> TagKeys:
    """These of one variable. `encoding`: its number on the wire; None: a bit."""
    member, element = split_name(variable.name)
    kind, arithmetic = "BOOL", ""
    if encoding is not None:
        kind, arithmetic = value_type(variable.kind, encoding.type, encoding.scale, encoding.offset)
    return {
        "number": variable.number,
        "name": variable.name,
        "member": member,
        "element": element,
        "kind": variable.kind,
        "type": kind,
        "arithmetic": arithmetic,
        "encoding": encoding,
        "unit": printable(variable.unit),
        "comment": printable(variable.comment),
        "limits": variable.limits,
        "on_stale": variable.on_stale,
        "owners": tuple(writer + 1 for writer in owners(variable, cell)),
    }


def split_name(name: str) -> tuple[str, int | None]:
    """Member and index: `("tcp", 0)` of `tcp[0]`."""
    member, bracket, rest = name.partition("[")
    return member, int(rest.removesuffix("]")) if bracket else None


def members(tags: Sequence[Tag]) -> tuple[TagFamily, ...]:
    """Variables and families of them, in the order of the mapping. Raises ExportError for a family with gaps."""
    return tuple(_members(tags))


def _members(tags: Sequence[Tag]) -> Iterator[TagFamily]:
    families: dict[str, list[Tag]] = {}
    for tag in tags:
        families.setdefault(tag.member, []).append(tag)
    for name, its in families.items():
        types = {tag.type for tag in its}
        whole = its[0].element is None or [tag.element for tag in its] == list(range(len(its)))
        if len(types) > 1 or not whole:
            raise ExportError(
                f"`{name}` is no array of one type: {', '.join(f'`{tag.name}` {tag.type}' for tag in its[:3])}: "
                "give all of its elements a place with the same owner, or put them into lines of their own"
            )
        yield TagFamily(name, its[0].type, tuple(its))


def writer_of(cell: CellDefinition, candidates: Collection[int], name: str | None, where: str) -> int | None:
    """Index of the writer that the PLC is, of those on the link, which `where` names; None: it only reads.

    Raises ExportError where the name is none of them, and where there are several and no name.
    """
    known = sorted(candidates)
    names = [cell.writers[writer].name for writer in known]
    if name == NOBODY or not (known or name):
        return None
    if name is None and len(known) == 1:
        return known[0]
    if name in names:
        return known[names.index(name)]
    choice = alternatives([*names, NOBODY])
    if name is None:
        raise ExportError(
            f"the mapping has several writers on {where}: say which the PLC is, with --writer: {choice}"
        )
    otherwise = any(writer.name == name for writer in cell.writers)
    hint = "; the mapping has it on another link" if otherwise else ""
    raise ExportError(f"`{name}` is no writer on {where}: --writer is one of {choice}{hint}")


def renamed(tags: Sequence[_Tag], names: Mapping[str, str]) -> list[_Tag]:
    """The tags under the names that they have in the PLC.

    Raises ExportError for a name that there is not, and where two variables would be called alike.
    """
    known = {tag.member for tag in tags}
    for name in names:
        if name not in known:
            raise ExportError(
                f"--name {name}={names[name]}: {did_you_mean(name, known, f'there is no `{name}`')}"
            )
    called: dict[str, str] = {}
    for member in dict.fromkeys(tag.member for tag in tags):
        name = names.get(member, member)
        other = called.setdefault(name, member)
        if other != member:
            both = f"`{other}` and `{member}`"
            changed = member if member in names else other
            raise ExportError(
                f"{both} would both be called `{name}`: give one another name here: --name {changed}=NAME"
            )
    return [replace(tag, member=names.get(tag.member, tag.member)) for tag in tags]
