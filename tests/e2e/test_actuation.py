"""What reaches the robot, and only that: releases, adopted commands of a dead PLC, writes in every pending state."""

from __future__ import annotations

import time

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import HMI, NO_PATH, PLC, Plc
from tests.e2e.processes import Daemon, Simulator, wait_for

GOOD, STALE, UNAVAILABLE, NEVER = range(4)
DIFFERS = 5
CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
  hmi: {{modbus: {HMI}}}
variables:
  command:  {{robot: input_int_register_0,            modbus: 0,   owner: plc}}
  setpoint: {{robot: input_double_register_0,         modbus: 2,   owner: plc, on_release: hold}}
  lamp:     {{robot: standard_digital_output.2,       modbus: 6.0, owner: plc}}
  lamp_set: {{robot: standard_digital_output_mask.2,  modbus: 6.1, owner: plc}}
"""
COMMAND, SETPOINT, LAMP, LAMP_SET = range(1, 5)


def start(plant: Plant, *options: str, robot_options: str = "") -> tuple[Simulator, Daemon, Plc]:
    simulator = plant.simulator(*(options or ("--program", "demo")))
    daemon = plant.daemon(plant.mapping(CELL, simulator.port, robot_options=robot_options))
    return simulator, daemon, plant.ready_plc()


def outputs(simulator: Simulator) -> int:
    return simulator.integer("actual_digital_output_bits")


def drive(simulator: Simulator, plc: Plc) -> None:
    """The PLC sets its command and its lamp."""
    assert plc.write_integers(0, 7) == 0
    assert plc.write(6, [0b11]) == 0
    wait_for(
        lambda: simulator.integer("input_int_register_0") == 7 and outputs(simulator) == 4, "the commands"
    )


def passed(plc: Plc, packages: int) -> None:
    """So many packages have come."""
    before = plc.status(15)
    wait_for(lambda: (plc.status(15) - before) & 0xFFFF >= packages, f"{packages} packages")


@pytest.mark.parametrize("ends", ["close", "SIGTERM"])
def test_a_release_reaches_registers_and_outputs(plant: Plant, ends: str) -> None:
    simulator, daemon, plc = start(plant)
    drive(simulator, plc)
    if ends == "close":
        plc.close()
    else:
        code, took = daemon.stop()
        assert code == 0
        assert took < 3
    wait_for(
        lambda: simulator.integer("input_int_register_0") == 0 and outputs(simulator) == 0, "the release"
    )
    wait_for(lambda: simulator.integer("standard_digital_output_mask") == 0, "the mask to be cleared")
    assert outputs(simulator) == 0
    assert "Traceback" not in daemon.text()


@pytest.mark.parametrize("ends", [False, True], ids=["runs on", "SIGTERM"])
def test_nothing_is_swallowed_while_new_registers_wait_for_a_frozen_clock(plant: Plant, ends: bool) -> None:
    simulator = plant.simulator()
    simulator.do("hold input_double_register_0")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    drive(simulator, plc)
    simulator.do("freeze on")
    simulator.do("free input_double_register_0")
    passed(plc, 200)  # the claim is tried again each second
    assert plc.quality(SETPOINT) == UNAVAILABLE
    assert plc.write_integers(0, 42) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "what was acknowledged")
    assert plc.write_doubles(2, 1.0) == NO_PATH
    if ends:
        assert daemon.stop()[0] == 0
    else:
        plc.close()
    wait_for(
        lambda: simulator.integer("input_int_register_0") == 0 and outputs(simulator) == 0, "the release"
    )
    if not ends:
        simulator.do("freeze off")
        again = plant.plc()
        wait_for(lambda: again.quality(SETPOINT) == GOOD, "the freed register")
        assert again.write_doubles(2, 1.5) == 0
        wait_for(lambda: simulator.number("input_double_register_0") == 1.5, "a write to it")


def test_the_command_of_a_dead_plc_falls_back_after_a_restart(plant: Plant) -> None:
    """Gateway killed, PLC dead: the next gateway adopts what it left, says so, and gives it up in time."""
    simulator, daemon, plc = start(plant, robot_options=", adopt_for: 1500ms")
    drive(simulator, plc)
    assert plc.write_doubles(2, 2.5) == 0
    wait_for(lambda: simulator.number("input_double_register_0") == 2.5, "the setpoint")
    daemon.kill()
    plc.close()
    again = plant.daemon(plant.directory / "cell.yaml")
    viewer = plant.ready_plc(HMI)
    assert viewer.integers(0) == [7], "adopted"
    line = again.wait_for_line("adopted values fall back soon")
    assert "command" in line
    simulator.do("drop-clients")
    began = time.monotonic()
    wait_for(
        lambda: simulator.integer("input_int_register_0") == 0 and outputs(simulator) == 0, "the fallbacks"
    )
    assert time.monotonic() - began < 5
    wait_for(lambda: simulator.integer("standard_digital_output_mask") == 0, "the mask to be cleared")
    assert simulator.number("input_double_register_0") == 2.5, "what is to be held is held"
    assert len(again.lines("adopted values fall back soon")) == 1


def test_a_living_plc_keeps_what_it_claims_in_time(plant: Plant) -> None:
    simulator, daemon, plc = start(plant, robot_options=", adopt_for: 3s")
    drive(simulator, plc)
    daemon.kill()
    again = plant.daemon(plant.directory / "cell.yaml")
    plc = plant.ready_plc()
    again.wait_for_line("adopted values fall back soon")
    assert plc.write_integers(0, 7) == 0
    assert plc.write(6, [0b11]) == 0
    passed(plc, 600)
    assert (simulator.integer("input_int_register_0"), outputs(simulator)) == (7, 4)
    assert not again.lines("fallback applied")


def test_the_robot_holds_something_else(plant: Plant) -> None:
    """Given 7, held 99: not good for as long, and sent again; what was only adopted follows the robot."""
    simulator, daemon, plc = start(plant)
    drive(simulator, plc)
    simulator.do("set input_double_register_0 3.25")
    wait_for(lambda: plc.doubles(2) == [3.25], "the image to follow")
    assert plc.quality(SETPOINT) == GOOD
    simulator.do("overwrite input_int_register_0 99")
    wait_for(lambda: plc.quality(COMMAND) == DIFFERS, "the difference")
    assert plc.integers(0) == [7]
    assert plc.write_integers(0, 7) == 0
    assert plc.quality(COMMAND) == DIFFERS
    simulator.do("overwrite input_int_register_0 off")
    wait_for(lambda: plc.quality(COMMAND) == GOOD, "the difference to end")
    assert simulator.integer("input_int_register_0") == 7
    daemon.wait_for_line("read-back differs", "sent 7, the controller holds 99")
    assert simulator.number("input_double_register_0") == 3.25


def test_steady_writes_over_a_slow_line_are_no_difference(plant: Plant) -> None:
    simulator, daemon, plc = start(plant, "--program", "demo", "--delay", "0.6")
    end = time.monotonic() + 3
    number = 0
    while time.monotonic() < end:
        number += 1
        assert plc.write_integers(0, number) == 0
        assert plc.quality(COMMAND) == GOOD
    wait_for(lambda: simulator.integer("input_int_register_0") == number, "the last one")
    passed(plc, 125)
    assert not daemon.lines("read-back differs")


FULL = f"""\
writers: {{plc: {{modbus: {PLC}}}}}
variables:
  bits:    {{robot: input_bit_register_0..63,     modbus: 0.0, on_release: hold}}
  ints:    {{robot: input_int_register_0..47,     modbus: 100, on_release: hold}}
  doubles: {{robot: input_double_register_0..47,  modbus: 300, on_release: hold}}
"""


@pytest.mark.parametrize("lists", ["refuse", "complain", "ignore", "close"])
def test_a_write_wipes_no_neighbour_whatever_the_lists_are(plant: Plant, lists: str) -> None:
    """A controller that does not take long lists; the connection is cut in the middle of a set-up, too."""
    simulator = plant.simulator("--program", "demo", "--strict-lists", lists)
    for number in range(48):
        simulator.do(f"set input_int_register_{number} {1000 + number}")
        simulator.do(f"set input_double_register_{number} {number + 0.5}")
    simulator.do("set input_bit_registers0_to_31 305419896")
    simulator.do("drop-at outputs:1")
    plant.daemon(plant.mapping(FULL, simulator.port))
    plc = plant.ready_plc()
    assert plc.integers(100, 48) == [1000 + number for number in range(48)]
    assert plc.write_integers(100, 7) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 7, "the write")
    assert [simulator.integer(f"input_int_register_{n}") for n in range(1, 48)] == list(range(1001, 1048))
    assert [simulator.number(f"input_double_register_{n}") for n in range(48)] == [n + 0.5 for n in range(48)]
    assert simulator.integer("input_bit_registers0_to_31") == 305419896


def test_what_cannot_be_read_is_left_alone_and_named(plant: Plant) -> None:
    simulator = plant.simulator("--program", "demo", "--unreadable", "input_int_register_0")
    simulator.do("set input_int_register_0 55")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    daemon.wait_for_line("inputs adopted", "not readable: command")
    assert plc.quality(COMMAND) == NEVER
    assert plc.write_doubles(2, 1.5) == 0
    wait_for(lambda: simulator.number("input_double_register_0") == 1.5, "the neighbour")
    assert simulator.integer("input_int_register_0") == 55
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 7, "the write")
    assert plc.quality(COMMAND) == GOOD
