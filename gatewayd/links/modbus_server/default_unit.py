"""Which cell of a listener answers to the unit ids 0 and 255, by which a client on TCP means the device itself.

It hangs on all cells of the listener that the client may reach. So a reload may take these ids from a cell, or turn
them to another robot, though the cell's own file is as it was.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from ipaddress import ip_address

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.peers import Address, may_connect
from gatewayd.links.modbus_server.plan import ModbusPlan, default_of
from gatewayd.links.modbus_server.session import UnitAccess
from gatewayd.report.format import verb
from gatewayd.report.wording import names_and_more

NamedPlan = tuple[str, ModbusPlan]
"""A unit, with the name of its cell."""

_UNLISTED = (ip_address("255.255.255.255"), ip_address("ffff::ffff"))
"""Nobody's addresses: they stand for those that no list names."""


def default_for(address: Address, units: Sequence[NamedPlan]) -> str | None:
    """The cell that answers the client at this address."""
    return default_of(_reached(address, units))


def default_cell(accesses: Mapping[int, UnitAccess]) -> Cell | None:
    """The same for a connection with these accesses."""
    cells = {access.unit.cell.definition.name: access.unit.cell for access in accesses.values()}
    name = default_of([(access.unit.cell.definition.name, access.unit.plan) for access in accesses.values()])
    return None if name is None else cells[name]


def lost(
    before: Sequence[NamedPlan], after: Sequence[NamedPlan], connected: Iterable[Address]
) -> dict[str, str | None]:
    """Cells that would be asked by 0 and 255 no more by some client, each with the one in its place, if there is any.

    Not those that the client could not reach any more: it loses more than that, unless another robot answered it.
    """
    found: dict[str, str | None] = {}
    for address in (*connected, *_addresses([*before, *after])):
        reached = _reached(address, after)
        old, new = default_for(address, before), default_of(reached)
        if old is not None and new != old and (new is not None or old in dict(reached)):
            found[old] = found.get(old) or new
    return found


def losing(cell: Cell, other: str | None, departing: Iterable[Requester]) -> Objection:
    """The objection of a cell that is one of `lost`; `departing`: its writers that might have asked by these ids."""
    answer = f"would be answered by {other}" if other is not None else "would find nobody"
    text = f"clients that ask for the unit ids 0 and 255 {answer}; `default_unit: true` keeps them"
    locks = cell.following(list(departing))
    if not locks:
        return Objection(ObjectionKind.WEAKENING, text)
    members = (member for lock in sorted(locks) for member in cell.ownership.locks[lock].members)
    names = [cell.definition.variables[member].name for member in members]
    owned = (
        f"{names_and_more(names)} {verb('be', count=len(names))} owned by such a client and would be released"
    )
    return Objection(ObjectionKind.RELEASE, f"{text}; {owned}")


def _reached(address: Address, units: Iterable[NamedPlan]) -> list[NamedPlan]:
    return [unit for unit in units if may_connect(address, unit[1])]


def _addresses(units: Iterable[NamedPlan]) -> Iterator[Address]:
    """One for every list of who may connect that there is, and for who is in none."""
    yield from _UNLISTED
    for network in {network for _name, plan in units for network in plan.allow}:
        yield from (network[0], network[-1])
