"""How findings about Modbus name places."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gatewayd.links.modbus_places.placing import ExpandedPlacement, PlacementProblem, all_placements
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.modbus.areas import Area

AREA_WORDS = {
    Area.HOLDING: "holding register",
    Area.INPUT: "input register",
    Area.COIL: "coil",
    Area.DISCRETE: "discrete input",
}
"""What one address of an area is called."""


def where(placement: ExpandedPlacement) -> str:
    """Where it lies, both ways of counting: `holding registers 100 to 103 (400101 to 400104)`."""
    word = AREA_WORDS[placement.area]
    if placement.width:
        last = placement.bits[-1]
        return f"bits {placement.bit} to {last} of {word} {placement.address} ({placement.notation})"
    if placement.bit is not None and placement.codec is not None:
        half = "high" if placement.bit else "low"
        return f"the {half} byte of {word} {placement.address} ({placement.notation})"
    if placement.bit is not None:
        return f"bit {placement.bit} of {word} {placement.address} ({placement.notation})"
    if placement.words == 1:
        return f"{word} {placement.address} ({placement.notation})"
    last = placement.address + placement.words - 1
    return f"{word}s {placement.address} to {last} ({placement.notation} to {placement.area.notation(last)})"


def first_of_each_line(placements: Iterable[ExpandedPlacement]) -> Iterator[ExpandedPlacement]:
    """Of a family on one line only the first: one mistake is one finding."""
    seen: set[tuple[str, int]] = set()
    for placement in placements:
        key = placement.variable.part.name, id(placement.spec)
        if key not in seen:
            seen.add(key)
            yield placement


def wrong(cell: ExpandedCell, problem: PlacementProblem) -> Iterator[ExpandedPlacement]:
    """The first of each line that cannot lie where the file puts it, for this reason."""
    return first_of_each_line(item for item in all_placements(cell) if item.problem is problem)
