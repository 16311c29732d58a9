"""Which values of a variable all of its places can show: the others are not good (quality OUT_OF_RANGE).

A place shows a value that it encodes without saturating; rounding to its own resolution is what it is for. So an
integer place ends half a step beyond its greatest number, where rounding begins to exceed that. A packed bit, a coil
and `bool` show of every number whether it is 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import ceil, floor, inf
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import ValueKind
from gatewayd.links.canopen_node.expand import CanopenCell
from gatewayd.mapping.expand import ConcreteVariable, ExpandedCell
from gatewayd.modbus.codec import TYPES, Codec

__all__ = ["EVERYTHING", "Shown", "shown_of"]

_HALF: Final = Fraction(1, 2)


@dataclass(frozen=True, slots=True)
class Shown:
    """What all places of a variable can show."""

    bounds: tuple[float, float] | None = None
    """Least and greatest robot value; None: all that the robot's type has."""
    nan: bool = True
    """Whether NaN and the infinities are shown as what they are."""


EVERYTHING: Final = Shown()
"""What a variable without a narrow place shows."""


@dataclass(frozen=True, slots=True)
class _Reach:
    """What one place can show, in the robot's unit."""

    low: Fraction | None
    high: Fraction | None
    is_real: bool


def shown_of(cell: ExpandedCell) -> list[Shown]:
    """What is shown of each variable of a cell, in the order of its variables."""
    reaches: list[list[_Reach]] = [[] for _ in cell.variables]
    for placement in cell.placements:
        if placement.codec is not None:
            reaches[placement.variable.index].append(_of_register(placement.codec))
    for index, can_type in _objects(cell.canopen):
        reaches[index].append(_of_object(can_type))
    return [
        _together(variable, places) if places else EVERYTHING
        for variable, places in zip(cell.variables, reaches, strict=True)
    ]


def _objects(node: CanopenCell | None) -> Iterator[tuple[int, CanType]]:
    for placed in node.objects if node is not None else ():
        if placed.plan.type is not CanType.BOOLEAN:
            yield placed.variable, placed.plan.type


@lru_cache(maxsize=4096)
def _of_register(codec: Codec) -> _Reach:
    number = TYPES[codec.type]
    is_truth = number.name == "bool" and codec.scale == 1 and codec.offset == 0
    if is_truth or number.name == "float64":
        return _Reach(None, None, number.is_real)
    scale, offset = Fraction(codec.scale), Fraction(codec.offset)
    return _scaled(number.low, number.high, scale, offset, is_real=number.is_real)


@lru_cache
def _of_object(can_type: CanType) -> _Reach:
    if can_type is CanType.REAL64:
        return _Reach(None, None, is_real=True)
    if can_type is CanType.REAL32:
        number = TYPES["float32"]
        return _scaled(number.low, number.high, Fraction(1), Fraction(0), is_real=True)
    signed = can_type.char.islower()
    low = -(1 << can_type.bits - 1) if signed else 0
    high = (1 << can_type.bits - signed) - 1
    return _scaled(low, high, Fraction(1), Fraction(0), is_real=False)


def _scaled(low: float, high: float, scale: Fraction, offset: Fraction, *, is_real: bool) -> _Reach:
    """What raw numbers from `low` to `high` are in the robot's unit."""
    beyond = Fraction(0) if is_real else abs(scale) * _HALF
    ends = sorted((Fraction(low) * scale + offset, Fraction(high) * scale + offset))
    return _Reach(ends[0] - beyond, ends[1] + beyond, is_real)


def _together(variable: ConcreteVariable, places: Iterable[_Reach]) -> Shown:
    places = tuple(places)
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
