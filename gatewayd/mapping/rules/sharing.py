"""Rules GW518 to GW520: what several writers own by turns, in groups and in registers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from gatewayd.core.definition import Direction, FallbackKind
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expand import ConcreteLock, ConcretePlacement, ConcreteVariable, ExpandedCell
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.wording import names_and_more, where
from gatewayd.modbus.areas import Area

__all__: list[str] = []

_LONGEST_WRITE = {Area.HOLDING: 123, Area.COIL: 1968}
"""Registers and coils that one request writes at most (Application Protocol V1.1b3, 6.11 and 6.12)."""


@cell_rule(
    "GW518",
    "inherited-value",
    "a held variable that the next owner of its group inherits",
    Severity.WARNING,
)
def inherited_value(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The first member with `hold` in each group that is taken over in pieces."""
    for lock in _taken_over(cell):
        held = [member for member in _members(cell, lock) if member.spec.on_release.kind is FallbackKind.HOLD]
        if lock.whole or not held:
            continue
        assert lock.group is not None
        first, higher = held[0], lock.owners[0]
        message = f"`{higher}` takes over the group `{lock.name}` and inherits the value of {_names(held)}"
        related = (Related(lock.group.key, f"the group `{lock.name}`"),)
        hint = f"write `on_release: clear` or a value at `{first.part.name}`, or `whole: true` at the group"
        yield rule.at(first.at("on_release"), message, hint=hint, related=related)


@cell_rule(
    "GW519",
    "split-group",
    "a group that no single request can take over whole",
    Severity.WARNING,
)
def split_group(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Groups with an owner that ranks above another and cannot write them in one request."""
    for lock in _taken_over(cell):
        members = _members(cell, lock)
        for name in lock.owners[:-1]:
            if _writes_whole(cell, members, cell.document.writers[name].spec):
                continue
            assert lock.group is not None
            message = f"`{name}` cannot take over the group `{lock.name}` with one request"
            gap = _first_apart(cell, members)
            related = () if gap is None else (Related(gap.position, f"`{gap.variable.name}` lies apart"),)
            hint = "lay its variables side by side, or write `takeover: false`"
            yield rule.at(lock.group.key, message, hint=hint, related=related)
            break


def _taken_over(cell: ExpandedCell) -> Iterator[ConcreteLock]:
    """Groups of several variables that a writer takes from another."""
    for lock in cell.locks:
        if lock.group is not None and lock.takeover and len(lock.owners) > 1 and len(lock.members) > 1:
            yield lock


def _members(cell: ExpandedCell, lock: ConcreteLock) -> list[ConcreteVariable]:
    return [cell.variables[index] for index in lock.members]


def _names(variables: Iterable[ConcreteVariable]) -> str:
    return names_and_more(list(dict.fromkeys(variable.part.name for variable in variables)))


def _writes_whole(cell: ExpandedCell, members: list[ConcreteVariable], writer: WriterSpec) -> bool:
    """Whether one request of a writer can write all of them. SDO writes one at a time."""
    if writer.modbus and any(_is_block(cell, members, area) for area in _LONGEST_WRITE):
        return True
    wanted = {member.index for member in members}
    pdos = cell.canopen.pdos if cell.canopen is not None else ()
    return writer.by_rpdo and any(wanted <= {entry.variable for entry in pdo.entries} for pdo in pdos)


def _is_block(cell: ExpandedCell, members: list[ConcreteVariable], area: Area) -> bool:
    """Whether all of them lie in an area without a gap, few enough for one request."""
    places = _places(cell, members, area)
    if len({place.variable.index for place in places}) < len(members):
        return False
    covered = {address for place in places for address in place.addresses}
    span = max(covered) - min(covered) + 1
    return span == len(covered) <= _LONGEST_WRITE[area]


def _places(cell: ExpandedCell, members: list[ConcreteVariable], area: Area) -> list[ConcretePlacement]:
    """Where they lie in an area: of each the first place, by address."""
    wanted = {member.index for member in members}
    first: dict[int, ConcretePlacement] = {}
    for place in cell.placements:
        if place.area is area and place.variable.index in wanted:
            first.setdefault(place.variable.index, place)
    return sorted(first.values(), key=lambda place: place.address)


def _first_apart(cell: ExpandedCell, members: list[ConcreteVariable]) -> ConcretePlacement | None:
    """The first holding register of the group that does not follow the one before it."""
    end: int | None = None
    for place in _places(cell, members, Area.HOLDING):
        if end is not None and place.address > end:
            return place
        end = max(end or 0, place.addresses.stop)
    return None


@cell_rule(
    "GW520",
    "shared-register",
    "a bit of several possible owners in a register with bits of other locks",
    Severity.WARNING,
)
def shared_register(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The first such bit of each line."""
    reported: set[str] = set()
    with_coil = {place.variable.index for place in cell.placements if place.area is Area.COIL}
    for bits in _registers(cell):
        if len({bit.lock for bit in bits}) < 2:
            continue
        for bit in bits:
            line = bit.place.variable.part.name
            if line in reported or bit.place.variable.index in with_coil or not _is_shared(cell, bit):
                continue
            reported.add(line)
            yield _shared_bit(rule, cell, bit, next(other for other in bits if other.lock != bit.lock))


@dataclass(frozen=True, slots=True)
class _Bit:
    place: ConcretePlacement
    lock: int


def _registers(cell: ExpandedCell) -> Iterable[list[_Bit]]:
    """The bits of inputs by holding register."""
    found: dict[int, list[_Bit]] = {}
    for place in cell.placements:
        variable = place.variable
        if place.area is not Area.HOLDING or place.bit is None or variable.direction is Direction.OUTPUT:
            continue
        if variable.lock is not None:
            found.setdefault(place.address, []).append(_Bit(place, variable.lock))
    return found.values()


def _is_shared(cell: ExpandedCell, bit: _Bit) -> bool:
    """Whether several writers may own it, one of them by Modbus."""
    owners = cell.locks[bit.lock].owners
    return len(owners) > 1 and any(cell.document.writers[name].spec.modbus for name in owners)


def _shared_bit(rule: Rule, cell: ExpandedCell, bit: _Bit, other: _Bit) -> Diagnostic:
    variable, neighbour = bit.place.variable, other.place.variable
    lock = cell.locks[bit.lock]
    owners = " or ".join(f"`{name}`" for name in lock.owners[:2]) + (" and others" if lock.owners[2:] else "")
    message = (
        f"writing the whole register does not acquire `{variable.name}` at {where(bit.place)}, which {owners} may own: "
        f"`{neighbour.name}` shares the register"
    )
    related = (Related(other.place.position, f"`{neighbour.name}` is here"),)
    hint = (
        "give it a register of its own or a coil, put the bits of the register into one `group`, or name one owner; "
        "as it is, function 22 (mask write) or a lock request acquires it"
    )
    return rule.at(bit.place.position, message, hint=hint, related=related)
