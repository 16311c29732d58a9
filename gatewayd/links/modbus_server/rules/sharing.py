"""Rules GW520 and GW859: bits in one register that several writers own by turns, and commands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from gatewayd.core.definition import Direction
from gatewayd.links.modbus_places.placing import ExpandedPlacement
from gatewayd.links.modbus_places.rules.wording import where
from gatewayd.links.modbus_server.expand import placements_of
from gatewayd.links.modbus_server.sections import ModbusWriter
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.modbus.areas import Area


@cell_rule("GW520", Severity.WARNING)
def shared_register(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A bit of several possible owners in a register with bits of other locks."""
    reported: set[str] = set()
    with_coil = {place.variable.index for place in placements_of(cell) if place.area is Area.COIL}
    for bits in _registers(cell):
        if len({bit.lock for bit in bits}) < 2:
            continue
        for bit in bits:
            line = bit.place.variable.part.name
            if line in reported or bit.place.variable.index in with_coil or not _is_shared(cell, bit):
                continue
            reported.add(line)
            yield _shared_bit(rule, cell, bit, next(other for other in bits if other.lock != bit.lock))


@cell_rule("GW859", Severity.WARNING)
def command_in_shared_register(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A command in a register with bits of other locks, whose write does not give it."""
    with_coil = {place.variable.index for place in placements_of(cell) if place.area is Area.COIL}
    for bits in _registers(cell):
        for bit in bits:
            other = next((other for other in bits if other.lock != bit.lock), None)
            command = bit.place.variable
            if other is None or not command.via or command.index in with_coil:
                continue
            message = (
                f"writing the whole register does not give the command `{command.name}` at {where(bit.place)}: "
                f"`{other.place.variable.name}` shares the register"
            )
            related = (Related(other.place.position, f"`{other.place.variable.name}` is here"),)
            hint = (
                "give it a register of its own or a coil, or put the bits of the register into one `group`; as it is, "
                "function 22 (mask write) alone gives it"
            )
            yield rule.at(bit.place.position, message, hint=hint, related=related)


@dataclass(frozen=True, slots=True)
class _Bit:
    place: ExpandedPlacement
    lock: int


def _registers(cell: ExpandedCell) -> Iterable[list[_Bit]]:
    """The bits of inputs by holding register."""
    found: dict[int, list[_Bit]] = {}
    for place in placements_of(cell):
        variable = place.variable
        if place.area is not Area.HOLDING or place.bit is None or variable.direction is Direction.OUTPUT:
            continue
        if variable.lock is not None:
            found.setdefault(place.address, []).append(_Bit(place, variable.lock))
    return found.values()


def _is_shared(cell: ExpandedCell, bit: _Bit) -> bool:
    """Whether several writers may own it, one of them by Modbus."""
    owners = cell.locks[bit.lock].owners
    return len(owners) > 1 and any(
        (spec := cell.document.writers[name].spec.by(ModbusWriter)).modbus or spec.role is not None
        for name in owners
    )


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
