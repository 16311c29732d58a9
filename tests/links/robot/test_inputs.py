"""What is due to the controller, and what it does not read back; pure, with times given."""

from __future__ import annotations

import math

from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.core.image import ProcessImage
from gatewayd.links.robot.inputs import LIVED_ON, SEND_AGAIN, ClaimedInputs
from gatewayd.links.robot.readback import VERIFY_AFTER, Finding, Package
from gatewayd.rtde.claims import REGISTERS_KEY, WATCHDOG_KEY, InputRecipe
from gatewayd.rtde.fields import Series
from gatewayd.rtde.messages import ControllerVersion
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session
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
OUTPUTS = Recipe(
    ("timestamp", "input_int_register_0", "input_double_register_0"),
    (DataType.DOUBLE, DataType.INT32, DataType.DOUBLE),
)
CLAIMED = {
    REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 1, REGISTERS),
    "speed_slider": InputRecipe("speed_slider", 2, SLIDERS),
    WATCHDOG_KEY: InputRecipe(WATCHDOG_KEY, 3, WATCHDOG),
}


def session(
    inputs: dict[str, InputRecipe] = CLAIMED, unread: frozenset[str] = frozenset(), round_trip: float = 0.0
) -> Session:
    version = ControllerVersion(5, 20, 0, 0)
    return Session(version, Series.E, 2, 0.002, OUTPUTS, inputs, (), {}, unread, round_trip)


class Bench:
    """An image and the inputs of a session that has adopted 5 and 2.5."""

    def __init__(
        self,
        variables: tuple[Variable, ...] = VARIABLES,
        agreed: Session | None = None,
    ) -> None:
        self.variables = variables
        self.image = ProcessImage(variables)
        self.given_at = [-math.inf] * len(variables)
        self.differing: set[int] = set()
        agreed = agreed or session()
        self.inputs = ClaimedInputs(variables, agreed)
        self.adopt(agreed, 5, 2.5, 10.0)

    def adopt(self, agreed: Session, number: int, real: float, now: float) -> dict[int, Value]:
        adopted = self.inputs.adopt(agreed, (0.0, number, real), now)
        for index, value in adopted.items():
            self.image.values[index] = value
        return adopted

    def write(self, index: int, value: Value, now: float) -> None:
        self.image.values[index], self.given_at[index] = value, now

    def send(self, now: float) -> dict[str, tuple[Value, ...]]:
        due = list(self.inputs.due(self.image.values, self.given_at, self.differing, now))
        for one in due:
            self.inputs.sent(one, now)
        return {one.recipe.key: one.values for one in due}

    def compare(self, number: int, real: float, now: float, lag: float = 0.0) -> Finding:
        found = self.inputs.compare(Package((0.0, number, real), self.given_at, self.differing, lag, now))
        self.differing |= found.differ.keys()
        self.differing -= found.agree
        for index, value in found.follow.items():
            self.image.values[index] = value
        return found


def test_what_was_adopted_is_not_due() -> None:
    bench = Bench()
    assert bench.image.values == [5, 2.5, 0.0]
    assert bench.send(10.0) == {}


def test_only_the_recipe_that_was_written_is_due_and_only_once() -> None:
    bench = Bench()
    bench.write(SLIDER, 0.5, 11.0)
    assert bench.send(11.0) == {"speed_slider": (0.5,)}
    assert bench.send(11.1) == {}


def test_an_equal_value_written_again_is_due() -> None:
    bench = Bench()
    bench.write(NUMBER, 5, 11.0)
    assert bench.send(11.0) == {REGISTERS_KEY: (5, 2.5)}


def test_what_nobody_knows_is_not_sent_whatever_the_image_holds() -> None:
    """The image keeps values of a former session; a zero that is written is sent though it changes nothing."""
    bench = Bench()
    bench.image.values[SLIDER] = 0.7
    assert bench.send(11.0) == {}
    bench.write(SLIDER, 0.0, 10.0)
    assert bench.send(12.0) == {"speed_slider": (0.0,)}


def test_a_field_that_joins_later_is_adopted_and_the_others_keep_what_is_under_way() -> None:
    alone = Recipe(REGISTERS.names[:1], REGISTERS.types[:1])
    bench = Bench(agreed=session({REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 4, alone)}))
    bench.write(NUMBER, 6, 11.5)
    assert bench.send(11.5) == {REGISTERS_KEY: (6,)}
    bench.write(NUMBER, 7, 11.6)
    assert bench.adopt(session(), 5, 9.5, 12.0) == {REAL: 9.5}
    assert bench.send(12.0) == {REGISTERS_KEY: (7, 9.5)}


WORD = "input_bit_registers0_to_31"


def test_a_word_that_cannot_be_read_is_completed_before_it_is_sent() -> None:
    bits = tuple(Variable(n + 1, f"bit{n}", Direction.INPUT, ValueKind.BOOL, WORD, bit=n) for n in (0, 1, 5))
    recipe = InputRecipe(WORD, 5, Recipe((WORD,), (DataType.UINT32,)))
    bench = Bench(bits, session({WORD: recipe}, frozenset({WORD})))
    assert bench.inputs.incomplete(bench.given_at) == []
    bench.write(1, True, 11.0)
    assert bench.inputs.incomplete(bench.given_at) == [0, 2]
    assert bench.send(11.0) == {}
    bench.write(0, True, 11.0)
    bench.write(2, False, 11.0)
    due = list(bench.inputs.due(bench.image.values, bench.given_at, (), 11.0))
    assert [one.values for one in due] == [(0b11,)]
    assert bench.inputs.sent(due[0], 11.0) == [WORD], "it is known now and can join the others"
    assert bench.inputs.sent(due[0], 11.0) == []
    joined = Recipe((WORD, *REGISTERS.names), (DataType.UINT32, *REGISTERS.types))
    bench.adopt(
        session({REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 6, joined)}, frozenset({WORD})), 1, 1.0, 12
    )
    bench.write(0, False, 13.0)
    assert bench.send(13.0) == {REGISTERS_KEY: (0b10, 1, 1.0)}


def test_a_difference_has_to_last_and_is_reported_once() -> None:
    bench = Bench()
    bench.write(NUMBER, 7, 11.0)
    bench.send(11.0)
    assert not bench.compare(5, 2.5, 11.0 + 0.9 * VERIFY_AFTER).differ, "it may be in flight"
    assert not bench.compare(99, 2.5, 12.0).differ
    text = {NUMBER: "input_int_register_0: sent 7, the controller holds 99"}
    assert bench.compare(99, 2.5, 12.0 + VERIFY_AFTER).differ == text
    assert bench.send(12.0 + VERIFY_AFTER) == {REGISTERS_KEY: (7, 2.5)}, "it is sent again"
    assert bench.send(12.1 + VERIFY_AFTER) == {}
    assert bench.send(12.0 + VERIFY_AFTER + SEND_AGAIN) == {REGISTERS_KEY: (7, 2.5)}
    assert bench.compare(7, 2.5, 14.0).agree == {NUMBER}
    assert bench.send(20.0) == {}


def test_what_is_read_back_is_known_of_each_variable() -> None:
    bench = Bench()
    assert [bench.inputs.held(index) for index in (NUMBER, REAL, SLIDER)] == [5, 2.5, None]
    bench.inputs.look((0.0, 99, 3.25))
    assert [bench.inputs.held(index) for index in (NUMBER, REAL)] == [99, 3.25]
    assert ClaimedInputs(VARIABLES).held(NUMBER) is None


def test_what_nobody_gave_follows_the_controller_and_is_not_overwritten() -> None:
    bench = Bench()
    assert bench.compare(5, 3.5, 11.0).follow == {REAL: 3.5}
    assert bench.send(11.0) == {}
    bench.write(NUMBER, 7, 12.0)
    assert bench.send(12.0) == {REGISTERS_KEY: (7, 3.5)}
    assert bench.compare(7, 3.5, 12.1) == Finding(is_settled=True)


def test_a_short_pulse_of_somebody_else_is_not_sent_again_by_a_neighbours_write() -> None:
    """What it held a moment ago is no value that is under way: nobody gave it."""
    bench = Bench()
    assert bench.compare(5, 3.5, 11.0).follow == {REAL: 3.5}
    assert bench.compare(5, 2.5, 11.002).follow == {REAL: 2.5}
    bench.write(NUMBER, 7, 11.004)
    assert bench.send(11.004) == {REGISTERS_KEY: (7, 2.5)}


def test_a_short_pulse_in_a_shared_word_is_not_sent_again() -> None:
    """Neither that of a mapped bit nor that of a free one, though the word itself is under way."""
    bits = tuple(
        Variable(bit + 1, f"bit{bit}", Direction.INPUT, ValueKind.BOOL, "input_int_register_0", bit=bit)
        for bit in range(2)
    )
    only = Recipe(("input_int_register_0",), (DataType.INT32,))
    bench = Bench(bits, session({REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 1, only)}))
    bench.compare(0, 2.5, 10.5)
    bench.write(0, True, 11.0)
    assert bench.send(11.0) == {REGISTERS_KEY: (0b001,)}
    bench.compare(0b111, 2.5, 11.01)
    bench.compare(0b001, 2.5, 11.02)
    bench.write(0, False, 11.03)
    assert bench.send(11.03) == {REGISTERS_KEY: (0,)}


def test_bits_that_no_variable_carries_follow_too() -> None:
    bit = (Variable(1, "bit", Direction.INPUT, ValueKind.BOOL, "input_int_register_0", bit=3),)
    only = Recipe(("input_int_register_0",), (DataType.INT32,))
    bench = Bench(bit, session({REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 1, only)}))
    bench.compare(0b10001, 2.5, 11.0)
    bench.write(0, True, 12.0)
    assert bench.send(12.0) == {REGISTERS_KEY: (0b11001,)}


def test_a_steady_write_over_a_slow_line_is_no_difference() -> None:
    """0.6 s there and back, a new value every 10 ms; the handshake has measured it."""
    bench = Bench(agreed=session(round_trip=0.6))
    now = 11.0
    for step in range(400):
        now += 0.01
        bench.write(NUMBER, step, now)
        bench.send(now)
        found = bench.compare(step - 60 if step >= 60 else 5, 2.5, now)
        assert not found.differ
        assert not found.follow


def test_a_line_that_becomes_slow_is_measured_and_its_lag_allowed_for() -> None:
    bench = Bench(agreed=session(round_trip=0.01))
    now = 11.0
    for step in range(800):
        now += 0.01
        bench.write(NUMBER, step, now)
        bench.send(now)
        late = 150 if step > 300 else 1
        found = bench.compare(max(step - late, 0) if step > 1 else 5, 2.5, now, lag=1.5 if late > 1 else 0.0)
        assert not found.differ, step


def test_a_controller_that_never_takes_changing_values_is_noticed() -> None:
    bench = Bench()
    differ: dict[int, str] = {}
    for step in range(300):
        now = 11.0 + step * 0.01
        bench.write(NUMBER, step + 1000, now)
        bench.send(now)
        differ |= bench.compare(99, 2.5, now).differ
    assert NUMBER in differ


def test_nan_reads_back_as_itself() -> None:
    bench = Bench()
    bench.write(REAL, math.nan, 11.0)
    bench.send(11.0)
    assert bench.compare(5, math.nan, 13.0) == Finding()


def test_variables_left_out_are_neither_adopted_nor_sent() -> None:
    bench = Bench()
    bench.inputs = ClaimedInputs(VARIABLES, session())
    adopted = bench.inputs.adopt(session(), (0.0, 5, 9.5), 11.0, without={REAL})
    assert adopted == {NUMBER: 5}
    bench.write(REAL, 1.0, 12.0)
    assert bench.send(12.0) == {}


def test_other_variables_are_carried_by_the_same_recipes() -> None:
    """New ones begin with what the controller was last given, read back or not; nothing is sent by it."""
    bench = Bench()
    bench.write(NUMBER, 7, 11.0)
    assert bench.send(11.0) == {REGISTERS_KEY: (7, 2.5)}
    renamed = (VARIABLES[REAL], Variable(2, "count", Direction.INPUT, ValueKind.INT, "input_int_register_0"))
    held = bench.inputs.rebind(renamed)
    assert held == {0: 2.5, 1: 7}
    bench.image = ProcessImage(renamed)
    bench.image.values[:] = [2.5, 7]
    bench.given_at = [-math.inf] * 2
    assert bench.send(12.0) == {}
    bench.write(1, 8, 13.0)
    assert bench.send(13.0) == {REGISTERS_KEY: (8, 2.5)}


def test_what_is_not_known_is_not_made_up_for_new_variables() -> None:
    bench = Bench()
    held = bench.inputs.rebind(
        (Variable(1, "speed", Direction.INPUT, ValueKind.FLOAT, "speed_slider_fraction"),)
    )
    assert held == {}


def test_a_fallback_has_arrived_when_it_reads_back_or_the_session_lived_on() -> None:
    bench = Bench(agreed=session(round_trip=0.1))
    bench.write(NUMBER, 0, 11.0)
    bench.write(SLIDER, 0.5, 11.0)

    def arrived(number: int, now: float) -> list[int]:
        return bench.inputs.delivered((0.0, number, 2.5), (NUMBER, SLIDER), bench.image.values, now)

    assert arrived(0, 11.0) == [], "it was not even sent"
    bench.send(11.0)
    assert arrived(0, 11.0) == [], "what reads back may be what stood there before"
    assert arrived(5, 11.2) == []
    assert arrived(0, 11.3) == [NUMBER]
    assert SLIDER in arrived(0, 11.1 + LIVED_ON)
