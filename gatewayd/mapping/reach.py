"""What one place of a variable can show, in the robot's unit.

A place shows a value that it encodes without saturating; rounding to its own resolution is what it is for. So an
integer place ends half a step beyond its greatest number, where rounding begins to exceed that.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

_HALF: Final = Fraction(1, 2)


@dataclass(frozen=True, slots=True)
class Reach:
    """What one place can show, in the robot's unit."""

    low: Fraction | None
    """None: all that the robot's type has."""
    high: Fraction | None
    is_real: bool
    """Whether NaN and the infinities are shown as what they are."""
    is_source: bool = False
    """Whether the variable's values only come from here, and nobody reads there what it is."""


def scaled(
    low: float,
    high: float,
    scale: Fraction = Fraction(1),
    offset: Fraction = Fraction(0),
    *,
    is_real: bool,
) -> Reach:
    """What raw numbers from `low` to `high` are in the robot's unit."""
    beyond = Fraction(0) if is_real else abs(scale) * _HALF
    ends = sorted((Fraction(low) * scale + offset, Fraction(high) * scale + offset))
    return Reach(ends[0] - beyond, ends[1] + beyond, is_real)
