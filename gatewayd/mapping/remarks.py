"""What conversions do to the real numbers of a cell, where that is as declared and no mistake: for `gatewayd check`.

The whole of it, by type and direction, is a table of the reference (docs/reference/mapping.md).
"""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.registry import languages
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.wording import names_and_more


def remarks(cell: ExpandedCell) -> Iterator[str]:
    """A sentence for each thing that happens to some of its variables."""
    unlimited: dict[str, None] = {}
    whole: dict[str, None] = {}
    for language in languages():
        for index, reach in language.reaches(cell):
            variable = cell.variables[index]
            if variable.kind is not ValueKind.FLOAT:
                continue
            if not reach.is_real:
                # A real that only comes from a device is a sum of its integers: nothing is made an integer.
                if not reach.is_source:
                    whole[variable.part.name] = None
            elif variable.direction is Direction.INPUT and variable.spec.limits is None:
                unlimited[variable.part.name] = None
    if whole:
        does = "reals are rounded to integers (halves to even), limited to the range of the type, and NaN becomes 0"
        yield f"{does}: {names_and_more(list(whole))}"
    if unlimited:
        yield f"without limits, NaN and infinities reach the robot: {names_and_more(list(unlimited))}"
