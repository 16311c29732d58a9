"""When a read-back is a difference; the comparison as a whole is in tests/links/robot/test_inputs.py."""

from __future__ import annotations

import math

from gatewayd.core.definition import Direction, ValueKind, Variable
from gatewayd.links.robot.readback import Package, ReadBack, same
from gatewayd.links.robot.transfer import InputTransfer
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

FIELD = "input_int_register_0"
VARIABLE = Variable(1, "number", Direction.INPUT, ValueKind.INT, FIELD)
RECIPE = Recipe((FIELD,), (DataType.INT32,))
TRANSFER = InputTransfer((VARIABLE,), RECIPE.names, RECIPE.slots)


def read(back: ReadBack, sent: int, held: int, now: float) -> None:
    back.compare(TRANSFER, (sent,), Package((held,), [0.0], (), 0.0, now))


def test_same_knows_nan_and_lengths() -> None:
    assert same((1, math.nan), (1.0, math.nan))
    assert not same((1,), (2,))
    assert not same((1,), (1, 2))


def test_the_round_trip_is_measured_and_fades() -> None:
    back = ReadBack(RECIPE.slots, 0.01)
    back.note(FIELD, (0,), 0.0, is_sent=False)
    read(back, 0, 0, 0.0)
    back.note(FIELD, (1,), 1.0, is_sent=True)
    read(back, 1, 0, 1.1)
    read(back, 1, 1, 1.4)
    assert back.round_trip == 1.4 - 1.0
    back.note(FIELD, (2,), 2.0, is_sent=True)
    read(back, 2, 2, 2.0)
    assert 0.3 < back.round_trip < 0.4


def test_what_was_adopted_or_foreign_measures_nothing() -> None:
    back = ReadBack(RECIPE.slots, 0.01)
    back.note(FIELD, (0,), 0.0, is_sent=False)
    read(back, 0, 0, 5.0)
    back.note(FIELD, (1,), 6.0, is_sent=True)
    read(back, 1, 99, 7.0)
    read(back, 1, 1, 16.0)
    assert back.round_trip == 0.01


def test_a_field_that_changes_faster_than_is_remembered_is_not_judged() -> None:
    back = ReadBack(RECIPE.slots, 5.0)
    for step in range(3000):
        back.note(FIELD, (step,), step * 0.001, is_sent=True)
    found = back.compare(TRANSFER, (2999,), Package((99999,), [0.0], (), 0.0, 3.0))
    assert not found.differ
    assert not found.is_settled
