"""Running robot programs, cycle by cycle."""

from __future__ import annotations

import pytest

from gatewayd.rtde.fields import INPUTS
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.interpreter import Interpreter
from gatewayd.simulator.program import DEMO, ProgramError, parse
from gatewayd.simulator.store import FieldStore, Scalar


class Machine:
    """A program at 100 cycles per second: 10 ms are one cycle."""

    def __init__(self, program: str) -> None:
        self.store: FieldStore = Controller().store
        self.interpreter = Interpreter(parse(program), self.store, 100, INPUTS)

    def put(self, name: str, value: Scalar) -> None:
        self.store.write(name, (value,))

    def get(self, name: str) -> Scalar:
        return self.store.read(name)[0]

    def trace(self, inputs: list[Scalar], source: str, target: str) -> list[Scalar]:
        """What the target shows in each cycle."""
        shown = []
        for value in inputs:
            self.put(source, value)
            self.interpreter.run()
            shown.append(self.get(target))
        return shown


BIT_IN, BIT_OUT = "input_bit_register_64", "output_bit_register_64"
INT_IN, INT_OUT = "input_int_register_0", "output_int_register_0"


def test_the_demo_echoes_every_reserved_register() -> None:
    machine = Machine(DEMO)
    values: dict[str, Scalar] = {"bit_registers0_to_31": 0xDEADBEEF, "bit_registers32_to_63": 0x80000001}
    values |= {f"int_register_{n}": -(2**31) + n for n in range(24)}
    values |= {f"double_register_{n}": n / 3 for n in range(24)}
    for name, value in values.items():
        machine.put(f"input_{name}", value)
    machine.interpreter.run()
    assert {name: machine.get(f"output_{name}") for name in values} == values
    assert machine.get("output_int_register_24") == 0


def test_echoes_are_scaled_rounded_and_kept_in_range() -> None:
    machine = Machine(f"{INT_OUT} = {INT_IN} * 2.5 + 0.2")
    assert machine.trace([3, 2**31 - 1, -(2**31)], INT_IN, INT_OUT) == [8, 2**31 - 1, -(2**31)]


def test_single_bits_of_words_leave_their_neighbours_alone() -> None:
    machine = Machine("output_bit_register_40 = input_bit_register_3")
    machine.put("output_bit_registers32_to_63", 0xF000_0000)
    shown = machine.trace([0b1000, 0b0111], "input_bit_registers0_to_31", "output_bit_registers32_to_63")
    assert shown == [0xF000_0100, 0xF000_0000]


def test_rules_run_in_order_also_when_copies_overlap() -> None:
    machine = Machine("output_int_register_1..3 = output_int_register_0..2")
    machine.put(INT_OUT, 5)
    machine.interpreter.run()
    assert [machine.get(f"output_int_register_{n}") for n in range(4)] == [5, 5, 5, 5]


def test_after_delays_both_edges() -> None:
    shown = Machine(f"{BIT_OUT} = {BIT_IN} after 20ms").trace([1, 1, 1, 1, 0, 1, 1, 1], BIT_IN, BIT_OUT)
    assert shown == [0, 0, 1, 1, 1, 1, 0, 1]


def test_for_makes_a_pulse_of_every_rising_edge() -> None:
    shown = Machine(f"{BIT_OUT} = {BIT_IN} for 30ms").trace([1, 1, 1, 1, 0, 0, 1, 0, 0, 0], BIT_IN, BIT_OUT)
    assert shown == [1, 1, 1, 0, 0, 0, 1, 1, 1, 0]


def test_count_and_toggle_on_rising_edges() -> None:
    edges: list[Scalar] = [0, 1, 1, 0, 1, 0, 0, 1]
    assert Machine(f"{INT_OUT} = count {BIT_IN}").trace(edges, BIT_IN, INT_OUT) == [0, 1, 1, 1, 2, 2, 2, 3]
    assert Machine(f"{BIT_OUT} = toggle {BIT_IN}").trace(edges, BIT_IN, BIT_OUT) == [0, 1, 1, 1, 0, 0, 0, 1]


def test_count_and_toggle_at_intervals() -> None:
    assert Machine(f"{INT_OUT} = count every 20ms").trace([0] * 6, BIT_IN, INT_OUT) == [0, 1, 1, 2, 2, 3]
    assert Machine(f"{BIT_OUT} = toggle every 30ms").trace([0] * 6, BIT_IN, BIT_OUT) == [0, 0, 1, 1, 1, 0]


def test_an_interval_is_not_lost_with_skipped_cycles() -> None:
    machine = Machine(f"{INT_OUT} = count every 20ms")
    for cycles in (3, 1, 1):
        machine.interpreter.run(cycles)
    assert machine.get(INT_OUT) == 2


def test_a_counter_can_be_set_and_wraps_to_0() -> None:
    machine = Machine(f"{INT_OUT} = count {BIT_IN}")
    machine.put(INT_OUT, 2**31 - 1)
    assert machine.trace([1, 0, 1], BIT_IN, INT_OUT) == [0, 0, 1]


def test_a_moving_source_is_read_now_and_a_moving_target_stops() -> None:
    machine = Machine(
        "output_double_register_0 = actual_q[1]; actual_digital_input_bits.3 = input_bit_register_64"
    )
    machine.store.write("actual_digital_input_bits", (0,))
    machine.store.moment = machine.store.moment._replace(path=3.0)
    assert machine.trace([1, 0], BIT_IN, "actual_digital_input_bits") == [8, 0]
    assert machine.get("output_double_register_0") == machine.store.read("actual_q")[1]


def test_negation_and_constants() -> None:
    assert Machine(f"{BIT_OUT} = not {BIT_IN}").trace([1, 0], BIT_IN, BIT_OUT) == [False, True]
    assert Machine(f"{INT_OUT} = -7").trace([0], BIT_IN, INT_OUT) == [-7]


@pytest.mark.parametrize(
    "program,message",
    [
        ("output_int_register_48 = 1", "1:1: the controller has no field 'output_int_register_48'"),
        ("output_int_register_0 = nothing", "1:25: the controller has no field 'nothing'"),
        (
            "input_int_register_0 = 1",
            "1:1: input_int_register_0 is a controller input: only clients write it",
        ),
        ("timestamp = 1", "1:1: timestamp follows the controller's cycles and cannot be a target"),
        ("output_double_register_0 = actual_q", "1:28: actual_q has 6 elements: write actual_q[0]"),
        ("output_double_register_0 = actual_q[6]", "1:28: actual_q (VECTOR6D) has no element 6"),
        ("output_int_register_0 = safety_status_bits.32", "1:25: safety_status_bits (UINT32) has no bit 32"),
        ("output_double_register_0.1 = 1", "1:1: output_double_register_0 (DOUBLE) has no bit 1"),
    ],
)
def test_a_rule_about_what_is_not_there_is_refused_with_its_place(program: str, message: str) -> None:
    with pytest.raises(ProgramError) as caught:
        Machine(program)
    assert str(caught.value) == "program:" + message
