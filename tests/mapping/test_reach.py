"""What raw numbers are in the robot's unit."""

from __future__ import annotations

from fractions import Fraction

from gatewayd.mapping.reach import Reach, scaled


def test_integers_end_where_rounding_exceeds_them() -> None:
    assert scaled(0, 10, is_real=False) == Reach(Fraction(-1, 2), Fraction(21, 2), is_real=False)
    assert scaled(0, 10, Fraction(1, 10), Fraction(5), is_real=False) == Reach(
        Fraction(99, 20), Fraction(121, 20), is_real=False
    )


def test_a_negative_scale_turns_the_ends_round() -> None:
    assert scaled(0, 10, Fraction(-1), is_real=True) == Reach(Fraction(-10), Fraction(0), is_real=True)
