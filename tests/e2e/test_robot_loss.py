"""What PLCs see when the robot goes, stands still, falls silent, comes back, or has given registers away."""

from __future__ import annotations

import time

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import FAILED, HMI, NO_PATH, PLC, Plc
from tests.e2e.processes import HOST, Daemon, Simulator, free_port, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
  hmi: {{modbus: {HMI}}}
variables:
  command:   {{robot: input_int_register_0,     modbus: 0,  owner: plc, on_release: hold}}
  setpoint:  {{robot: input_double_register_0,  modbus: 2,  owner: plc, on_release: hold}}
  cleared:   {{robot: output_int_register_0,    modbus: 20}}
  held:      {{robot: output_int_register_0,    modbus: 22, on_stale: hold}}
  valued:    {{robot: output_int_register_0,    modbus: 24, on_stale: -1}}
  excepted:  {{robot: output_int_register_0,    modbus: 26, on_stale: exception}}
  lamp:      {{robot: output_bit_register_0,    modbus: [28.0, {{discrete: 0}}], on_stale: true}}
  fragile:   {{robot: output_bit_register_1,    modbus: {{discrete: 1}}, on_stale: exception}}
"""
COMMAND, SETPOINT, CLEARED, HELD, VALUED, EXCEPTED, LAMP, FRAGILE = range(1, 9)
GOOD, STALE, UNAVAILABLE, NEVER = range(4)
LOST, WAITING, FRESH, SILENT, FROZEN, LATE = range(6)
"""Values of the status block."""
ROBOT_AGE, PACKAGES, LAG = 11, 15, 45
"""Offsets of the lower words of its numbers."""


def start(plant: Plant, text: str = CELL, **options: str) -> tuple[Simulator, Daemon, Plc]:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(text, simulator.port, **options))  # type: ignore[arg-type]
    return simulator, daemon, plant.ready_plc()


def qualities(plc: Plc) -> list[int]:
    return [plc.quality(number) for number in range(1, 9)]


def assert_fallbacks(plc: Plc) -> None:
    """What every policy shows while the robot does not tell; the last value was 7."""
    assert plc.integers(20, 3) == [0, 7, -1]
    assert plc.reading_code(26, 2) == FAILED
    assert plc.reading_code(20, 8) == FAILED, "a block with an excepted value in it"
    assert plc.read(28) == [1]
    assert plc.discrete(0, 1) == [True]
    assert not any(plc.good(number) for number in (CLEARED, HELD, VALUED, EXCEPTED, LAMP, FRAGILE))
    assert {plc.quality(number) for number in (CLEARED, HELD, VALUED, EXCEPTED, LAMP, FRAGILE)} == {STALE}


def test_robot_killed_and_restarted_with_other_values(plant: Plant) -> None:
    """Everything goes stale and comes back; what the restarted robot holds is shown, and not overwritten."""
    simulator, daemon, plc = start(plant)
    assert plc.write_integers(0, 7) == 0
    assert plc.write_doubles(2, 1.5) == 0
    wait_for(lambda: plc.integers(20, 4) == [7] * 4, "the echo in all four")
    assert qualities(plc) == [GOOD] * 8

    simulator.kill()
    took = wait_for(lambda: plc.robot_state == LOST, "the loss of the robot")
    print(f"robot killed -> lost: {took * 1000:.0f} ms")
    assert_fallbacks(plc)
    assert qualities(plc)[:2] == [STALE, STALE]
    assert plc.integers(0) == [7]
    assert plc.write_integers(0, 8) == FAILED
    assert plc.refusal[0] == 6
    assert not plc.writable

    again = plant.simulator(
        "--program",
        "demo",
        "--program",
        "output_int_register_1 = count input_int_register_0",
        "--uptime",
        "5",  # as a restarted controller: its clock has gone back
        port=simulator.port,
    )
    # Before the gateway is back, the robot's own program (or another tool) has put other values there.
    again.do("set input_int_register_0 123456")
    again.do("set input_double_register_0 -2.5")
    took = wait_for(lambda: plc.robot_state == FRESH and plc.writable, "the robot to come back")
    print(f"robot listening again -> fresh and writable: {took * 1000:.0f} ms")
    assert took < 4
    wait_for(lambda: plc.integers(0) == [123456], "the adopted value")
    assert plc.doubles(2) == [-2.5]
    wait_for(lambda: plc.integers(20, 4) == [123456] * 4, "good values instead of fallbacks")
    assert qualities(plc) == [GOOD] * 8
    assert all(plc.good(number) for number in range(1, 9))
    assert again.integer("input_int_register_0") == 123456
    assert again.number("input_double_register_0") == -2.5
    assert plc.write_integers(0, 9) == 0
    wait_for(lambda: again.integer("input_int_register_0") == 9, "the next write")
    assert again.number("input_double_register_0") == -2.5, "a write carries its neighbours as they were"
    assert len(daemon.lines("robot lost")) == 1
    assert len(daemon.lines("robot connected")) == 2
    assert "Traceback" not in daemon.text()


def test_no_robot_from_the_start(plant: Plant) -> None:
    """Modbus is served: never-told values as fallbacks, writes 0B; one line in the log, not one per attempt."""
    daemon = plant.daemon(plant.mapping(CELL, free_port()))
    plc = plant.plc()
    line = daemon.wait_for_line("no robot")
    assert "connection refused" in line
    assert plc.robot_state == LOST
    assert set(qualities(plc)) == {NEVER}
    assert plc.integers(20, 3) == [0, 0, -1]
    assert plc.reading_code(26, 2) == FAILED
    assert plc.write_integers(0, 1) == FAILED
    heartbeat = plc.status(4)
    wait_for(lambda: plc.status(4) >= heartbeat + 12, "twelve heartbeats")
    assert len(daemon.lines("no robot")) == 1
    assert len(daemon.lines("error")) == 0


@pytest.mark.parametrize("host", ["255.255.255.255", "robot.invalid"])
def test_a_robot_that_cannot_be_reached_is_one_line(plant: Plant, host: str) -> None:
    path = plant.mapping(CELL, 30004)
    path.write_text(path.read_text().replace(f"host: {HOST}, port", f"host: {host}, port", 1))
    daemon = plant.daemon(path)
    plc = plant.plc()
    wait_for(lambda: len(daemon.lines("no robot")) == 1, "the reason")
    assert host in daemon.lines("no robot")[0]
    assert plc.robot_state == LOST
    assert "Traceback" not in daemon.text()


def test_delay_in_small_steps_and_a_clock_that_creeps_are_late(plant: Plant) -> None:
    """Each package has a new timestamp and comes in time after the last one; only the lag says how old it is."""
    simulator, daemon, plc = start(plant)
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: plc.integers(20, 4) == [7] * 4, "the echo")
    for step in range(1, 21):
        simulator.do(f"delay {step * 0.05}")
        began = plc.status(PACKAGES)
        wait_for(lambda began=began: plc.status(PACKAGES) - began & 0xFFFF > 5, "packages")  # type: ignore[misc]
    wait_for(lambda: plc.robot_state == LATE, "late values to count as such")
    assert_fallbacks(plc)
    assert plc.status(LAG) >= 400
    assert plc.status(ROBOT_AGE) >= 400

    simulator.do("delay 0")
    wait_for(lambda: plc.robot_state == FRESH, "quick packages")
    wait_for(lambda: plc.integers(20, 4) == [7] * 4, "good values")
    assert plc.status(LAG) < 400

    simulator.do("creep on")
    wait_for(lambda: plc.robot_state == LATE, "a clock that creeps to count as late")
    assert_fallbacks(plc)
    assert len([line for line in daemon.lines("robot values stale") if "detail=late" in line]) == 2


def test_frozen_timestamp_is_stale_though_packages_come(plant: Plant) -> None:
    simulator, daemon, plc = start(plant, stale_after="300ms")
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: plc.integers(20) == [7], "the echo")
    simulator.do("freeze on")
    took = wait_for(lambda: plc.robot_state == FROZEN, "the frozen robot to be noticed")
    print(f"frozen -> noticed: {took * 1000:.0f} ms")
    packages = plc.status(15)
    wait_for(lambda: plc.status(15) != packages, "packages that still come")
    assert_fallbacks(plc)
    simulator.do("freeze off")
    took = wait_for(lambda: plc.robot_state == FRESH, "the robot to go on")
    wait_for(lambda: plc.integers(20, 4) == [7] * 4, "its values")
    # One new session tells that nothing has queued up behind the clock meanwhile.
    daemon.wait_for_line("robot lost", "its clock stood still")
    wait_for(lambda: plc.writable and qualities(plc) == [GOOD] * 8, "the new session")
    assert len(daemon.lines("robot values stale", "frozen")) == 1
    assert len(daemon.lines("robot lost")) == 1


def test_silence_is_stale_and_then_a_loss(plant: Plant) -> None:
    """A controller that sends nothing is stale after `stale_after`, and after a second it is connected to anew."""
    simulator, daemon, plc = start(plant, stale_after="200ms")
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: plc.integers(20) == [7], "the echo")
    simulator.do("silence on")
    took = wait_for(lambda: plc.robot_state == SILENT, "the silence to be noticed")
    print(f"silent -> noticed: {took * 1000:.0f} ms")
    assert_fallbacks(plc)
    daemon.wait_for_line("robot lost", "no data")
    assert plc.robot_state in (LOST, WAITING)
    assert_fallbacks(plc)
    simulator.do("silence off")
    wait_for(lambda: plc.robot_state == FRESH and plc.writable, "the robot to be back")
    assert plc.integers(20, 4) == [7] * 4


def test_writes_while_frozen_or_silent_still_reach_the_robot(plant: Plant) -> None:
    """The connection is up and the robot takes inputs: what is stale is what it tells."""
    simulator, _daemon, plc = start(plant, stale_after="200ms")
    simulator.do("freeze on")
    wait_for(lambda: plc.robot_state == FROZEN, "the frozen robot")
    assert plc.write_integers(0, 42) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "the write")


def test_registers_in_use_cost_only_themselves(plant: Plant) -> None:
    """Three registers claimed elsewhere: 0A for them, all others work, and they recover when freed."""
    text = f"""\
writers: {{plc: {{modbus: {PLC}}}}}
variables:
  bits:    {{robot: input_bit_register_0..63,    modbus: 0.0}}
  ints:    {{robot: input_int_register_0..23,    modbus: 100, on_release: hold}}
  doubles: {{robot: input_double_register_0..23, modbus: 200, on_release: hold}}
"""
    first_int, first_double = 65, 89
    simulator = plant.simulator()
    simulator.do("set input_int_register_5 5555")
    simulator.do("hold input_int_register_5,input_double_register_7,input_bit_registers32_to_63")
    daemon = plant.daemon(plant.mapping(text, simulator.port))
    plc = plant.ready_plc()

    taken = {first_int + 5, first_double + 7, *range(33, 65)}
    assert {number for number in range(1, 113) if plc.quality(number) == UNAVAILABLE} == taken
    assert plc.write_integers(110, 1) == NO_PATH
    assert plc.refusal[:2] == (7, first_int + 5)
    assert plc.write_doubles(228, 1.0) == NO_PATH
    assert plc.write(2, [1]) == NO_PATH
    assert plc.write_integers(108, 1, 2, 3) == NO_PATH, "all or nothing"
    for number in range(24):
        if number != 5:
            assert plc.write_integers(100 + 2 * number, number + 1) == 0
        if number != 7:
            assert plc.write_doubles(200 + 4 * number, number + 0.5) == 0
    assert plc.write(0, [0xFFFF, 0x8001]) == 0
    wait_for(lambda: simulator.number("input_double_register_23") == 23.5, "the free registers")
    assert [simulator.integer(f"input_int_register_{n}") for n in range(24) if n != 5] == [
        n + 1 for n in range(24) if n != 5
    ]
    assert simulator.integer("input_bit_registers0_to_31") == 0x8001FFFF
    for name in ("input_int_register_5", "input_double_register_7", "input_bit_registers32_to_63"):
        line = daemon.wait_for_line("register unavailable", f"field={name}")
        assert "IN_USE" in line
        assert "PROFINET" in line or "ur_rtde" in line or "another" in line

    simulator.do("set input_int_register_5 6666")
    simulator.do("free input_int_register_5,input_double_register_7,input_bit_registers32_to_63")
    took = wait_for(
        lambda: not any(plc.quality(number) for number in range(1, 113)), "the freed registers to be good"
    )
    print(f"freed -> good: {took * 1000:.0f} ms")
    assert plc.integers(110) == [6666], "what the register holds is adopted"
    assert simulator.integer("input_int_register_5") == 6666
    assert simulator.integer("input_int_register_4") == 5
    assert plc.write_integers(108, 1, 2, 3) == 0
    assert plc.write_doubles(228, 7.5) == 0
    assert plc.write(2, [0x00FF, 0]) == 0
    wait_for(lambda: simulator.integer("input_bit_registers32_to_63") == 0xFF, "the recovered word")
    assert simulator.number("input_double_register_7") == 7.5
    assert [simulator.integer(f"input_int_register_{n}") for n in (4, 5, 6)] == [1, 2, 3]
    daemon.wait_for_line("register available", "field=input_int_register_5")


def test_claims_of_the_last_connection_linger(plant: Plant) -> None:
    """A controller may keep the claims of a dead connection for a while: the gateway's own are its own again."""
    simulator = plant.simulator("--program", "demo", "--linger", "1200")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: plc.integers(20) == [7], "the echo")
    simulator.do("drop-clients")
    daemon.wait_for_line("register unavailable", "field=input_int_register_0", "IN_USE")
    wait_for(lambda: plc.robot_state == FRESH, "the next session")
    assert plc.quality(COMMAND) == UNAVAILABLE
    assert plc.write_integers(0, 8) == NO_PATH
    wait_for(lambda: qualities(plc) == [GOOD] * 8, "the registers to be good again")
    assert plc.integers(0) == [7]
    assert simulator.integer("input_int_register_0") == 7
    assert plc.write_integers(0, 9) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 9, "a write")


def test_robot_messages_are_logged_on_one_line(plant: Plant) -> None:
    simulator = plant.simulator("--program", "demo", "--text-on-connect", "SafetySetup not confirmed")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    daemon.wait_for_line("the controller says", "SafetySetup not confirmed")
    simulator.do("text protective stop \x1b[31m C204A1")
    line = daemon.wait_for_line("the controller says", "protective stop", "C204A1")
    assert "\x1b" not in line
    assert plc.robot_state == FRESH


def test_controller_restart_during_boot(plant: Plant) -> None:
    """The interface starts again once while the controller boots; the gateway is back by itself."""
    simulator = plant.simulator("--program", "demo", "--uptime", "0")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: plc.integers(20) == [7], "the echo")
    simulator.do("restart")
    daemon.wait_for_line("robot lost")
    wait_for(lambda: plc.writable and plc.robot_state == FRESH, "the robot to be back")
    assert plc.integers(0) == [0], "the restarted controller's registers are 0, and stay so"
    assert simulator.integer("input_int_register_0") == 0


def test_protocol_version_1_and_many_cut_connections(plant: Plant) -> None:
    """An old controller whose connection is cut again and again: set up anew each time, values stay."""
    simulator = plant.simulator("--program", "demo", "--protocol-v1", "--series", "cb3")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: plc.integers(20) == [7], "the echo")
    times = []
    for _ in range(4):
        sessions = plc.status(13)
        began = time.monotonic()
        simulator.do("drop-clients")
        wait_for(lambda s=sessions: plc.status(13) > s and plc.writable, "the next session")  # type: ignore[misc]
        times.append(time.monotonic() - began)
        assert simulator.integer("input_int_register_0") == 7
        assert plc.integers(0) == [7]
    print("cut -> writable again, ms:", *(f"{t * 1000:.0f}" for t in times))
    assert max(times) < 3
    wait_for(lambda: len(daemon.lines("robot connected")) == 5, "a line for each session")


@pytest.mark.parametrize(
    "order", [("robot", "daemon", "plc"), ("daemon", "robot"), ("daemon", "plc", "robot")]
)
def test_started_in_any_order(plant: Plant, order: tuple[str, ...]) -> None:
    port = free_port()
    path = plant.mapping(CELL, port)
    plc: Plc | None = None
    for what in order:
        if what == "robot":
            simulator = plant.simulator(port=port)
        elif what == "daemon":
            plant.daemon(path)
        else:
            plc = plant.plc()
    plc = plc or plant.plc()
    wait_for(lambda: plc.writable, "the robot")
    assert plc.write_integers(0, 7) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 7, "the value in the robot")
    wait_for(lambda: plc.integers(20) == [7], "its echo")
