"""What the simulated robot holds and reports."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.maptest.actions import CellNames
from gatewayd.maptest.robot import typed
from tests.maptest.written import plant


@pytest.mark.parametrize(
    "kind,value,expected",
    [
        (ValueKind.BOOL, 1, True),
        (ValueKind.INT, 5.0, 5),
        (ValueKind.INT, 5.5, 5.5),
        (ValueKind.FLOAT, 5, 5.0),
    ],
)
def test_values_have_the_type_of_their_variable(kind: ValueKind, value: Value, expected: Value) -> None:
    variable = Variable(1, "v", Direction.INPUT, kind, "f")
    found = typed(variable, value)
    assert (found, type(found)) == (expected, type(expected))


def test_connecting_twice_is_one_session() -> None:
    one = plant()
    one.robot.connect(one.now)
    assert one.cell.health.sessions == 1


def test_what_it_took_it_holds_through_a_loss() -> None:
    """Of an input of which the cell gave nothing it holds what was there: zero."""
    one = plant()
    names = CellNames(one.cell.definition)
    one.write(names.writers["plc"], names.values({"speed": 5}))
    one.robot.lose(one.now)
    one.cell.image.values[names.variables["speed"]] = 0.0
    one.robot.connect(one.now)
    assert one.cell.image.values[names.variables["speed"]] == 5.0
    assert one.cell.image.values[names.variables["clamp"]] == 0.0


def test_registers_of_one_word_are_given_together() -> None:
    """The robot lends 32 bits as one; `light` is a bit of the second word."""
    one = plant()
    names = CellNames(one.cell.definition)
    one.robot.give([names.variables["start"]], available=False, now=one.now)
    available = one.cell.image.available
    assert not available[names.variables["start"]]
    assert available[names.variables["light"]]
    one.robot.give([names.variables["go"]], available=False, now=one.now)
    assert not available[names.variables["light"]]
