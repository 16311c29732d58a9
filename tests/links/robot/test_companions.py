"""What goes out for actuators behind masks; pure, with times given. test_release.py looks at the robot."""

from __future__ import annotations

import math

from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.links.robot.companions import Actuation, Driven, Key, Stage, all_inputs, all_outputs
from gatewayd.links.robot.transfer import InputTransfer
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

ANALOG = Recipe(
    ("standard_analog_output_mask", "standard_analog_output_type", "standard_analog_output_0"),
    (DataType.UINT8, DataType.UINT8, DataType.DOUBLE),
)
DIGITAL = Recipe(
    ("standard_digital_output_mask", "standard_digital_output"), (DataType.UINT8, DataType.UINT8)
)
RATIO = Variable(1, "ratio", Direction.INPUT, ValueKind.FLOAT, "standard_analog_output_0")
MASK = Variable(2, "mask", Direction.INPUT, ValueKind.BOOL, "standard_analog_output_mask", bit=0)
TYPE = Variable(3, "type", Direction.INPUT, ValueKind.BOOL, "standard_analog_output_type", bit=0)
OUT = Variable(1, "out", Direction.INPUT, ValueKind.INT, "standard_digital_output")
SELECT = Variable(2, "select", Direction.INPUT, ValueKind.INT, "standard_digital_output_mask")
VOLTS = 0b0100


class Bench:
    def __init__(self, recipe: Recipe, *variables: Variable) -> None:
        self.variables = variables
        self.values: list[Value] = [variable.kind.zero for variable in variables]
        self.given_at = [-math.inf] * len(variables)
        self.driven = Driven()
        self.stages: dict[Key, Stage] = {}
        self.transfer = InputTransfer(variables, recipe.names, recipe.slots)
        self.actuation = Actuation(variables, self.transfer, self.driven, self.stages)

    def give(self, index: int, value: Value) -> None:
        self.values[index], self.given_at[index] = value, 1.0

    def compose(self) -> tuple[Value, ...]:
        return self.actuation.compose(self.transfer, self.values, self.given_at)


def test_the_domain_is_subscribed_and_the_type_claimed_for_analog_outputs_alone() -> None:
    assert all_outputs(("a",), (OUT, SELECT)) == all_inputs(("a",), (OUT, SELECT)) == ("a",)
    assert all_outputs((), (RATIO, MASK)) == ("analog_io_types",)
    assert all_inputs((), (RATIO, MASK)) == ("standard_analog_output_type",)


def test_an_unmapped_type_is_the_domain_that_the_controller_is_in() -> None:
    bench = Bench(ANALOG, RATIO, MASK)
    bench.give(0, 0.5)
    bench.give(1, True)
    assert bench.compose() == (0, 0, 0.5), "not known: nothing acts"
    bench.actuation.domains = VOLTS
    assert bench.compose() == (1, 1, 0.5)
    bench.actuation.domains = 0b1011
    assert bench.compose() == (1, 0b10, 0.5), "the other output keeps its own"


def test_a_mapped_type_that_nobody_chose_is_the_controllers() -> None:
    bench = Bench(ANALOG, RATIO, MASK, TYPE)
    bench.give(0, 0.5)
    bench.give(1, True)
    assert bench.actuation.undecided(bench.given_at) == [2]
    bench.actuation.domains = VOLTS
    assert bench.actuation.undecided(bench.given_at) == []
    assert bench.compose() == (1, 1, 0.5)
    bench.give(2, False)
    assert bench.compose() == (1, 0, 0.5)


def test_a_release_goes_out_in_the_domain_that_was_last_driven() -> None:
    bench = Bench(ANALOG, RATIO, MASK, TYPE)
    bench.actuation.domains = 0
    for index, value in enumerate((0.5, True, True)):
        bench.give(index, value)
    bench.actuation.sent(bench.compose(), 1.01)
    for index, value in enumerate((0.0, False, False)):
        bench.give(index, value)
        bench.actuation.release(index, value)
    assert bench.compose() == (1, 1, 0.0)
    assert bench.actuation.is_releasing(0)
    bench.actuation.sent(bench.compose(), 2.01)
    assert [stage.until for stage in bench.stages.values()] == [2.01]
    bench.actuation.sent(bench.compose(), 3.01)
    assert [stage.until for stage in bench.stages.values()] == [2.01], "it ends when it was first sent to end"
    bench.stages.clear()
    assert bench.compose() == (0, 0, 0.0)


def test_what_was_not_given_goes_out_as_zero_and_its_mask_is_not_set() -> None:
    bench = Bench(DIGITAL, OUT, SELECT)
    bench.values[0] = 0xFF
    bench.give(1, 0xFF)
    assert bench.compose() == (0, 0)
    bench.give(0, 0x0F)
    assert bench.compose() == (0xFF, 0x0F)


def test_a_whole_integer_releases_what_was_driven_and_unknown_means_all() -> None:
    bench = Bench(DIGITAL, OUT, SELECT)
    bench.give(0, 0)
    bench.actuation.release(0, 0)
    assert bench.compose() == (0xFF, 0)
    bench.stages.clear()
    bench.actuation.release(0, 0)
    assert bench.compose() == (0xFF, 0), "it is not known to have arrived"
    bench.stages.clear()
    bench.actuation.delivered(0)
    bench.give(0, 0x03)
    bench.give(1, 0x01)
    bench.actuation.sent(bench.compose(), 1.0)
    bench.give(0, 0x10)
    bench.give(1, 0x00)
    bench.actuation.release(0, 0x10)
    assert bench.compose() == (0x01, 0x10), "the value as a whole, the mask only where it was set"


def test_an_unmapped_mask_bit_is_never_set() -> None:
    bit = Variable(2, "one", Direction.INPUT, ValueKind.BOOL, "standard_digital_output_mask", bit=2)
    bench = Bench(DIGITAL, OUT, bit)
    bench.give(0, 0xFF)
    bench.actuation.release(0, 0)
    assert bench.compose()[0] == 0b100
