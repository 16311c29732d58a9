"""Which values of a variable all of its places can show: the others are not good (quality OUT_OF_RANGE)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor, inf

from gatewayd.core.definition import ValueKind
from gatewayd.links.registry import languages
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.reach import Reach


@dataclass(frozen=True, slots=True)
class Shown:
    """What all places of a variable can show."""

    bounds: tuple[float, float] | None = None
    """Least and greatest robot value; None: all that the robot's type has."""
    nan: bool = True
    """Whether NaN and the infinities are shown as what they are."""


def shown_of(cell: ExpandedCell) -> list[Shown]:
    """What is shown of each variable of a cell, in the order of its variables."""
    reaches: list[list[Reach]] = [[] for _ in cell.variables]
    for language in languages():
        for index, reach in language.reaches(cell):
            if not reach.is_source:
                reaches[index].append(reach)
    return [
        _together(variable, places) if places else Shown()
        for variable, places in zip(cell.variables, reaches, strict=True)
    ]


def _together(variable: ExpandedVariable, places: Sequence[Reach]) -> Shown:
    nan = variable.kind is not ValueKind.FLOAT or all(place.is_real for place in places)
    low = max((place.low for place in places if place.low is not None), default=None)
    high = min((place.high for place in places if place.high is not None), default=None)
    if variable.kind is ValueKind.BOOL or low is None or high is None:
        return Shown(None, nan)
    if variable.low is None or variable.high is None:
        return Shown((_real(low), _real(high)), nan)
    # Robot integers: whole numbers, exact beyond the 53 bits of a float.
    least, greatest = max(ceil(low), variable.low), min(floor(high), variable.high)
    return Shown(None if (least, greatest) == (variable.low, variable.high) else (least, greatest), nan)


def _real(bound: Fraction) -> float:
    try:
        return float(bound)
    except OverflowError:
        return inf if bound > 0 else -inf
