"""What is due to the controller, and what it does not read back; pure, with times given."""

from __future__ import annotations

import math

from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.core.image import ProcessImage
from gatewayd.robot.inputs import VERIFY_AFTER, ClaimedInputs
from gatewayd.rtde.claims import REGISTERS_KEY, WATCHDOG_KEY, InputRecipe
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

VARIABLES = (
    Variable(1, "number", Direction.INPUT, ValueKind.INT, "input_int_register_0"),
    Variable(2, "real", Direction.INPUT, ValueKind.FLOAT, "input_double_register_0"),
    Variable(3, "slider", Direction.INPUT, ValueKind.FLOAT, "speed_slider_fraction"),
)
NUMBER, REAL, SLIDER = range(3)
REGISTERS = Recipe(("input_int_register_0", "input_double_register_0"), (DataType.INT32, DataType.DOUBLE))
SLIDERS = Recipe(("speed_slider_fraction",), (DataType.DOUBLE,))
WATCHDOG = Recipe(("input_int_register_9",), (DataType.INT32,))
SLOTS = {
    "timestamp": slice(0, 1),
    "input_int_register_0": slice(1, 2),
    "input_double_register_0": slice(2, 3),
}
CLAIMED = {
    REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 1, REGISTERS),
    "speed_slider": InputRecipe("speed_slider", 2, SLIDERS),
    WATCHDOG_KEY: InputRecipe(WATCHDOG_KEY, 3, WATCHDOG),
}


class Bench:
    """An image and the inputs of a session that has adopted 5 and 2.5."""

    def __init__(self) -> None:
        self.image = ProcessImage(VARIABLES)
        self.inputs = ClaimedInputs(VARIABLES, SLOTS)
        self.adopt(CLAIMED, 5, 2.5, 10.0)

    def adopt(
        self, claimed: dict[str, InputRecipe], number: int, real: float, now: float
    ) -> dict[int, Value]:
        adopted = self.inputs.adopt(claimed, (0.0, number, real), self.image.values, now)
        for index, value in adopted.items():
            self.image.values[index] = value
        return adopted

    def write(self, index: int, value: Value, now: float) -> None:
        self.image.values[index], self.image.times[index] = value, now

    def send(self, now: float) -> list[str]:
        due = list(self.inputs.due(self.image))
        for key, flat in due:
            self.inputs.sent(key, flat, now)
        return [key for key, _ in due]

    def doubts(self, number: int, real: float, now: float) -> list[str]:
        return [str(doubt) for doubt in self.inputs.doubts((0.0, number, real), now)]


def test_what_was_adopted_is_not_due() -> None:
    bench = Bench()
    assert bench.image.values == [5, 2.5, 0.0]
    assert bench.send(10.0) == []


def test_only_the_recipe_that_was_written_is_due_and_only_once() -> None:
    bench = Bench()
    bench.write(SLIDER, 0.5, 11.0)
    assert bench.send(11.0) == ["speed_slider"]
    assert bench.send(11.1) == []


def test_an_equal_value_written_again_is_due() -> None:
    bench = Bench()
    bench.write(NUMBER, 5, 11.0)
    assert bench.send(11.0) == [REGISTERS_KEY]


def test_a_field_that_joins_later_is_adopted_and_the_others_keep_what_is_under_way() -> None:
    bench = Bench()
    alone = Recipe(REGISTERS.names[:1], REGISTERS.types[:1])
    bench.adopt({REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 4, alone)}, 5, 2.5, 11.0)
    bench.write(NUMBER, 6, 11.5)
    assert bench.send(11.5) == [REGISTERS_KEY]
    assert bench.adopt(CLAIMED, 5, 9.5, 12.0)[REAL] == 9.5
    assert dict(bench.inputs.due(bench.image)) == {}


def test_a_doubt_waits_for_the_controller_and_is_told_once() -> None:
    bench = Bench()
    bench.write(NUMBER, 7, 11.0)
    bench.send(11.0)
    assert bench.doubts(5, 2.5, 11.0 + VERIFY_AFTER / 2) == []
    assert bench.doubts(5, 2.5, 11.0 + VERIFY_AFTER) == [
        "input_int_register_0: sent 7, the controller holds 5"
    ]
    assert bench.doubts(5, 2.5, 13.0) == []
    assert bench.doubts(7, 2.5, 14.0) == []
    assert bench.doubts(5, 2.5, 15.0) != []


def test_nan_reads_back_as_itself() -> None:
    bench = Bench()
    bench.write(REAL, math.nan, 11.0)
    bench.send(11.0)
    assert bench.doubts(5, math.nan, 13.0) == []


def test_variables_left_out_are_neither_adopted_nor_sent() -> None:
    bench = Bench()
    bench.inputs = ClaimedInputs(VARIABLES, SLOTS)
    adopted = bench.inputs.adopt(CLAIMED, (0.0, 5, 9.5), bench.image.values, 11.0, without={REAL})
    assert adopted == {NUMBER: 5}
    bench.write(REAL, 1.0, 12.0)
    assert bench.send(12.0) == []
