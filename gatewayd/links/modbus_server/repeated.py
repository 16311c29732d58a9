"""Variables that lie in a table more than once: one request must not give them two values.

Their places may differ in type and scale. A request is of one mind if one of the values that it gives is what all the
places it covers say, each as well as its type can: 12.34 as a float32 and 123 as an integer with scale 0.1 are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gatewayd.core.admission import Change
from gatewayd.core.definition import Value
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.links.modbus_server.plan import Placement


class Repeated:
    """The variables of a table of registers that have several places in it."""

    def __init__(self, placements: Sequence[Placement]) -> None:
        places: dict[int, list[Placement]] = {}
        for placement in placements:
            places.setdefault(placement.variable, []).append(placement)
        self._places = {variable: found for variable, found in places.items() if len(found) > 1}

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self._places)

    def settled(self, changes: list[Change], address: int, data: bytes) -> list[Change] | Refusal:
        """`changes` with one value for each variable; a refusal where the words from `address` on are of two minds."""
        given: dict[int, list[Value]] = {}
        for change in changes:
            if change.variable in self._places:
                given.setdefault(change.variable, []).append(change.value)
        for variable, values in given.items():
            if all(value == values[0] for value in values):
                continue
            meant = next(
                (value for value in values if self._is_in_all_places(variable, value, address, data)), None
            )
            if meant is None:
                return Refusal(Reason.CONTRADICTED, variable)
            changes = [replace(item, value=meant) if item.variable == variable else item for item in changes]
        return changes

    def _is_in_all_places(self, variable: int, value: Value, address: int, data: bytes) -> bool:
        """Whether every place that the request covers holds `value`."""
        for place in self._places[variable]:
            start = 2 * (place.address - address)
            raw = data[start : start + 2 * place.words] if start >= 0 else b""
            if raw and not _holds(place, raw, value):
                return False
        return True


def _holds(place: Placement, raw: bytes, value: Value) -> bool:
    if place.bit is not None and place.codec is not None:
        raw = raw[:1] if place.bit else raw[1:]
    if place.codec is None:
        return bool(int.from_bytes(raw, "big") >> (place.bit or 0) & 1) == value
    return place.codec.encode(value) == raw or place.codec.decode(raw) == value
