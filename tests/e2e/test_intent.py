"""What nobody meant or knows passes for no command and no good value: groups, shared registers, places, programs."""

from __future__ import annotations

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import BUSY, HMI, NO_VALUE, PLC
from tests.e2e.processes import wait_for

GOOD = 0
OUT_OF_RANGE, NOT_RUNNING = 6, 7
PARTIAL_TAKEOVER, NOT_MEANT = 9, 11
"""Reasons as the status block numbers them."""
WRITERS = f"""\
writers:
  plc: {{modbus: {PLC}}}
  hmi: {{modbus: {HMI}}}
"""
GROUP = (
    WRITERS
    + """\
groups:
  motion: {owner: [plc, hmi], lease: 30sWHOLE}
variables:
  go:     {robot: input_bit_register_0,    modbus: 0.0, group: motion}
  target: {robot: input_int_register_0,    modbus: 1,   group: motion}
  speed:  {robot: input_double_register_0, modbus: 3,   group: motion, on_release: hold}
"""
)
GO, TARGET, SPEED = 1, 2, 3
SHARED = (
    WRITERS
    + """\
variables:
  jog:  {robot: input_bit_register_0, modbus: 0.0, owner: [plc, hmi], lease: 30s}
  mine: {robot: input_bit_register_1, modbus: 0.1, owner: plc}
"""
)
JOG, MINE = 1, 2
VALUES = """\
variables:
  narrow: {robot: output_double_register_0, modbus: {holding: 0, type: int16, scale: 0.1}}
  wide:   {robot: output_double_register_0, modbus: 1}
"""
PROGRAM = """\
variables:
  count: {robot: output_int_register_0, modbus: 5, valid: running}
  state: {robot: runtime_state,         modbus: 7}
"""
NARROW, WIDE = COUNT, STATE = 1, 2
QUIET = "output_bit_register_0 = 0"
"""A robot program that leaves the registers of the tests alone."""


@pytest.mark.parametrize("takes", ["writes", "requests"])
def test_a_takeover_inherits_no_command(plant: Plant, takes: str) -> None:
    """The new owner's target never meets the former owner's `go`."""
    simulator = plant.simulator()
    plant.daemon(plant.mapping(GROUP.replace("WHOLE", ""), simulator.port))
    plc, hmi = plant.ready_plc(), plant.plc(HMI)
    assert hmi.write(0, [1, 0, 5]) == 0
    assert hmi.write_doubles(3, 0.5) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 5, "the panel's target")
    assert simulator.integer("input_bit_registers0_to_31") == 1
    target = 9 if takes == "writes" else 0
    assert (plc.write_integers(1, 9) if takes == "writes" else plc.request(GO)) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == target, "the PLC's target")
    assert simulator.integer("input_bit_registers0_to_31") == 0
    assert simulator.number("input_double_register_0") == 0.5, "on_release: hold"
    assert [plc.owner(number) for number in (GO, TARGET, SPEED)] == [1, 1, 1]


def test_a_group_is_taken_over_whole_or_not_at_all(plant: Plant) -> None:
    simulator = plant.simulator()
    plant.daemon(plant.mapping(GROUP.replace("WHOLE", ", whole: true"), simulator.port))
    plc, hmi = plant.ready_plc(), plant.plc(HMI)
    assert hmi.write(0, [1, 0, 5]) == 0
    assert plc.write_integers(1, 9) == NO_VALUE
    assert plc.refusal[0] == PARTIAL_TAKEOVER
    assert simulator.integer("input_bit_registers0_to_31") == 1
    assert plc.write(0, [0, 0, 9, 0, 0, 0, 0]) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 9, "the PLC's target")
    assert simulator.integer("input_bit_registers0_to_31") == 0


@pytest.mark.parametrize("stopped_by", ["loss", "hmi"])
def test_a_word_that_was_read_before_a_stop_does_not_bring_it_back(plant: Plant, stopped_by: str) -> None:
    simulator = plant.simulator()
    plant.daemon(plant.mapping(SHARED, simulator.port))
    plc, hmi = plant.ready_plc(), plant.plc(HMI)
    assert hmi.write_one(0, 0b01) == BUSY, "a whole word takes no bit that others may own too"
    assert hmi.refusal[0] == NOT_MEANT
    assert hmi.request(JOG) == 0
    assert hmi.write_one(0, 0b01) == 0
    (word,) = plc.read(0)
    assert word == 0b01
    if stopped_by == "loss":
        hmi.close()
    else:
        assert hmi.write_one(0, 0b00) == 0
    wait_for(lambda: simulator.integer("input_bit_registers0_to_31") == 0, "the stop")
    assert plc.write_one(0, word | 0b10) == BUSY
    assert plc.owner(JOG) == (0 if stopped_by == "loss" else 2)
    assert plc.write_one(0, plc.read(0)[0] | 0b10) == 0, "what it means"
    wait_for(lambda: simulator.integer("input_bit_registers0_to_31") == 0b10, "its own bit")
    assert plc.owner(MINE) == 1
    if stopped_by == "hmi":
        assert hmi.write_one(0, 0b10) == 0, "the panel's next stop"


@pytest.mark.parametrize("value, shown", [("nan", 0), ("1e9", 0x7FFF), ("-1e9", 0x8000), ("inf", 0x7FFF)])
def test_what_a_register_cannot_show_is_not_good(plant: Plant, value: str, shown: int) -> None:
    simulator = plant.simulator("--program", QUIET)
    plant.daemon(plant.mapping(VALUES, simulator.port))
    plc = plant.ready_plc()
    simulator.do(f"set output_double_register_0 {value}")
    wait_for(lambda: plc.quality(NARROW) == OUT_OF_RANGE, "the quality")
    assert not plc.good(NARROW)
    assert plc.read(0) == [shown]
    assert plc.quality(WIDE) == GOOD, "another variable of the same field has room for it"
    simulator.do("set output_double_register_0 12.5")
    wait_for(lambda: plc.read(0) == [125] and plc.quality(NARROW) == GOOD, "a value that fits")


def test_registers_of_a_stopped_program_are_not_good(plant: Plant) -> None:
    simulator = plant.simulator("--program", QUIET)
    plant.daemon(plant.mapping(PROGRAM, simulator.port))
    plc = plant.ready_plc()
    simulator.do("set output_int_register_0 42")
    wait_for(lambda: plc.integers(5) == [42] and plc.quality(COUNT) == GOOD, "the program's value")
    for state, runs in ((4, True), (1, False), (2, True), (6, False), (3, True)):
        simulator.do(f"set runtime_state {state}")
        wait_for(lambda state=state: plc.integers(7) == [state], "the state")  # type: ignore[misc]
        assert plc.quality(COUNT) == (GOOD if runs else NOT_RUNNING)
        assert plc.integers(5) == [42 if runs else 0]
        assert plc.quality(STATE) == GOOD
