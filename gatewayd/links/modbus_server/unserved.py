"""Requests that a unit does not serve, in words that name what is there instead."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Iterable

from gatewayd.core.definition import CellDefinition
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.status_layout import BASE, LENGTH, covers
from gatewayd.core.unserved import Unserved
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement
from gatewayd.links.modbus_server.readable import Readable
from gatewayd.modbus.areas import AREA_NAMES, Area
from gatewayd.modbus.describe import Span, fault, function_text, reading, writing

_ILLEGAL_FUNCTION = 1
_TRADITIONAL = {Area.HOLDING: 40001, Area.INPUT: 30001, Area.DISCRETE: 10001}
"""First numbers of the five-digit notation, which clients ask for where they should have counted from 0."""


class Places:
    """What lies where in a unit, to find what is nearest to an address that has nothing."""

    def __init__(self, plan: ModbusPlan, definition: CellDefinition) -> None:
        self._variables = definition.variables
        self._by_area: dict[Area, list[Placement]] = {}
        for placement in sorted(plan.placements, key=lambda its: (its.address, its.bit or 0)):
            found = self._by_area.setdefault(placement.area, [])
            if not found or found[-1].address != placement.address:
                found.append(placement)
        self._starts = {
            area: [placement.address for placement in found] for area, found in self._by_area.items()
        }

    def is_mapped(self, area: Area, address: int) -> bool:
        """Whether a variable lies there."""
        before = self._before(area, address)
        return before is not None and address < before.address + before.words

    def unmapped(self, span: Span, is_there: Callable[[int], bool]) -> str:
        """What is missing in the span, and what is nearest to it."""
        end = span.first + span.quantity
        missing = next((address for address in range(span.first, end) if not is_there(address)), None)
        if missing is None:
            return "bits without a variable"
        if missing > 0xFFFF:
            return "addresses end at 65535"
        if not span.area.of_bits and covers(missing, 1):
            return f"the status block, {BASE}-{BASE + LENGTH - 1}, needs a request of its own"
        return f"{missing} is not mapped; {self._nearest(span.area, missing)}"

    def _nearest(self, area: Area, address: int) -> str:
        if area not in self._by_area:
            there = ", ".join(AREA_NAMES[other] for other in self._by_area)
            return f"this unit has nothing in {AREA_NAMES[area]}" + (f", only in {there}" if there else "")
        counted = address - _TRADITIONAL.get(area, 0)
        if area in _TRADITIONAL and counted >= 0 and self.is_mapped(area, counted):
            return f"addresses count from 0: {address} is {counted} here"
        before, after = self._before(area, address), self._after(area, address)
        near = min(
            (found for found in (before, after) if found is not None),
            key=lambda found: max(found.address - address, address - found.address - found.words + 1),
        )
        return f"nearest: {self._variables[near.variable].name} {near.place}"

    def _before(self, area: Area, address: int) -> Placement | None:
        position = bisect(self._starts.get(area, ()), address)
        return self._by_area[area][position - 1] if position else None

    def _after(self, area: Area, address: int) -> Placement | None:
        position, found = bisect(self._starts[area], address), self._by_area[area]
        return found[position] if position < len(found) else None


def named(refusal: Refusal, pdu: bytes, places: Places) -> Refusal:
    """The refusal of a write to an address that has nothing, with the address."""
    span = writing(pdu)
    if refusal.reason is not Reason.NO_SUCH_ADDRESS or span is None:
        return refusal
    hint = places.unmapped(span, lambda address: places.is_mapped(span.area, address))
    return Refusal(refusal.reason, refusal.variable, refusal.holder, f"wrote {span}", hint)


def unserved(
    pdu: bytes, code: int, places: Places, readable: Callable[[Area], Readable]
) -> tuple[Unserved, str] | None:
    """Why a request was answered with exception `code`, in words; None if the cell has recorded it as refused."""
    if code == _ILLEGAL_FUNCTION:
        if (
            writing(pdu) is not None
        ):  # every function that writes is served: the peer's role has no right to it
            return None
        return Unserved.NO_SUCH_FUNCTION, f"asked for {function_text(pdu)}, which is not served"
    wrong, span = fault(pdu), reading(pdu)
    if wrong:
        return Unserved.MALFORMED, f"asked for {function_text(pdu)}: {wrong}"
    if span is None:
        if writing(pdu) is None:
            return Unserved.MALFORMED, f"asked for {function_text(pdu)} with wrong data"
        return None
    table = readable(span.area)
    if table.mapped[span.first] < span.quantity and not _in_status(span):
        missing = places.unmapped(span, lambda address: address <= 0xFFFF and table.mapped[address] > 0)
        return Unserved.NO_SUCH_ADDRESS, f"read {span}: {missing}"
    if table.reach[span.first] < span.quantity and not _in_status(span):
        return Unserved.ROBOT_LOST, f"read {span}: held back while the robot does not report it"
    return None


def _in_status(span: Span) -> bool:
    return not span.area.of_bits and covers(span.first, span.quantity)


def unknown_unit(unit: int, here: Iterable[int]) -> str:
    """What is asked of a unit that is not there."""
    return f"asked unit {unit}; units here: {', '.join(map(str, sorted(here)))}"
