"""The daemon's own life: how it starts beside what is missing, ends, is killed, and comes back."""

from __future__ import annotations

import os
import signal
import socket
import time
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import FAILED, HMI, PLC, Plc
from tests.e2e.processes import HOST, Simulator, free_port, wait_for
from tests.e2e.slow_names import NAME

CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
  hmi: {{modbus: {HMI}}}
variables:
  cleared: {{robot: input_int_register_0,    modbus: 0,   owner: plc, on_release: clear}}
  held:    {{robot: input_int_register_1,    modbus: 2,   owner: plc, on_release: hold}}
  valued:  {{robot: input_double_register_0, modbus: 4,   owner: plc, on_release: -1.5}}
  bit:     {{robot: input_bit_register_33,   modbus: 8.0, owner: plc, on_release: clear}}
  echo:    {{robot: output_int_register_1,   modbus: 100}}
"""
FORCED = 130


def held(simulator: Simulator) -> tuple[int, int, float, int]:
    return (
        simulator.integer("input_int_register_0"),
        simulator.integer("input_int_register_1"),
        simulator.number("input_double_register_0"),
        simulator.integer("input_bit_registers32_to_63"),
    )


def write_all(plc: Plc, simulator: Simulator) -> None:
    assert plc.write_integers(0, 77, 88) == 0
    assert plc.write_doubles(4, 9.5) == 0
    assert plc.write(8, [1]) == 0
    wait_for(lambda: held(simulator) == (77, 88, 9.5, 2), "the values in the robot")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_stops_within_a_second_and_leaves_the_fallbacks_in_the_robot(
    plant: Plant, number: signal.Signals
) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    start = time.monotonic()
    daemon.signal(number)
    code = daemon.wait()
    took = time.monotonic() - start
    print(f"{number.name} -> exit {code}: {took * 1000:.0f} ms")
    assert code == 0
    assert took < 1
    # Sent before the connection was closed, so it is there once the simulator has read it.
    wait_for(lambda: simulator.do("clients") == "0", "the end of the connection")
    assert held(simulator) == (0, 88, -1.5, 0)
    daemon.wait_for_line("stopped")
    assert "Traceback" not in daemon.text()


def test_stops_within_a_second_whatever_its_peers_do(plant: Plant) -> None:
    """The robot hangs, one client reads no answers, one has sent half a request, one cell has no robot at all."""
    simulator = plant.simulator(frequency=500)
    first = plant.mapping(CELL, simulator.port, name="first")
    second = plant.mapping(CELL, free_port(), name="second", unit=2)
    daemon = plant.daemon(first, second)
    plc = plant.ready_plc()
    assert plc.write_integers(0, 77, 88) == 0
    with (
        socket.create_connection((HOST, plant.modbus)) as greedy,
        socket.create_connection((HOST, plant.modbus)) as half,
    ):
        half.sendall(b"\x00\x01\x00\x00\x00\x06\x01")
        greedy.setblocking(False)
        request = b"\x00\x01\x00\x00\x00\x06\x01\x03\xea\x60\x00\x7d"
        try:
            while True:
                greedy.send(request * 1000)
        except BlockingIOError:
            pass
        simulator.signal(signal.SIGSTOP)
        assert plc.status(7) in (2, 3)
        code, took = daemon.stop()
        simulator.signal(signal.SIGCONT)
    print(f"SIGTERM beside hanging peers -> exit {code}: {took * 1000:.0f} ms")
    assert code == 0
    assert took < 1


def test_stops_within_a_second_while_a_name_is_looked_up(plant: Plant) -> None:
    """The system's resolver cannot be interrupted; it must not hold the process."""
    path = plant.mapping(CELL, 30004)
    path.write_text(path.read_text().replace(f"host: {HOST}", f"host: {NAME}"))
    daemon = plant.start("slow_names", "run", str(path))
    daemon.wait_for_line("listening for Modbus")
    assert "does not answer" in daemon.wait_for_line("no robot", NAME)
    start = time.monotonic()
    daemon.signal(signal.SIGTERM)
    assert daemon.wait() == 0
    took = time.monotonic() - start
    print(f"SIGTERM while a name is looked up: {took * 1000:.0f} ms")
    assert took < 1
    daemon.wait_for_line("stopped")


def test_stops_at_once_before_anything_was_there(plant: Plant) -> None:
    daemon = plant.daemon(plant.mapping(CELL, free_port()))
    code, took = daemon.stop()
    assert code == 0
    assert took < 1


def test_second_signal_forces(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plant.ready_plc()
    # Both are there when it wakes, so that the second one comes before anything was done about the first.
    daemon.signal(signal.SIGSTOP)
    daemon.signal(signal.SIGTERM)
    daemon.signal(signal.SIGINT)
    daemon.signal(signal.SIGCONT)
    assert daemon.wait() == FORCED


@pytest.mark.parametrize("policy, after", [("adopt", (77, 88, 9.5, 2)), ("fallback", (0, 88, -1.5, 0))])
def test_killed_and_started_again(plant: Plant, policy: str, after: tuple[int, int, float, int]) -> None:
    """Bumpless: what the robot holds is taken over; with `on_connect: fallback` the policies are applied then."""
    # Each change of a register from 0 is counted by the robot program, so that a dip to 0 and back would show.
    program = "output_int_register_1 = count input_int_register_0"
    simulator = plant.simulator("--program", program)
    path = plant.mapping(CELL, simulator.port, robot_options=f", on_connect: {policy}")
    daemon = plant.daemon(path)
    plc = plant.ready_plc()
    write_all(plc, simulator)
    wait_for(lambda: plc.integers(100) == [1], "the count")
    daemon.kill()
    wait_for(lambda: simulator.do("clients") == "0", "the end of the connection")
    assert held(simulator) == (77, 88, 9.5, 2)

    start = time.monotonic()
    plant.daemon(path)
    served = time.monotonic() - start
    plc = plant.ready_plc()
    print(
        f"start -> listening: {served * 1000:.0f} ms, -> writable: {(time.monotonic() - start) * 1000:.0f} ms"
    )
    wait_for(lambda: held(simulator) == after, "what the policy says")
    assert (plc.integers(0, 2), plc.doubles(4), plc.read(8)) == ([*after[:2]], [after[2]], [after[3] >> 1])
    assert [plc.owner(number) for number in range(1, 5)] == [0] * 4
    assert plc.write_integers(2, 89) == 0
    wait_for(lambda: simulator.integer("input_int_register_1") == 89, "a write")
    assert simulator.integer("input_int_register_0") == after[0]
    assert plc.integers(100) == [1], "never 0 in between"


def test_port_in_use_is_one_line_and_served_once_it_is_free(plant: Plant) -> None:
    simulator = plant.simulator()
    with socket.create_server((HOST, plant.modbus)):
        other = free_port()
        daemon = plant.run(
            plant.mapping(CELL, simulator.port, name="blocked"),
            plant.mapping(CELL, free_port(), name="free", modbus=other),
        )
        line = daemon.wait_for_line("cannot listen on", f"{HOST}:{plant.modbus}")
        assert " error cannot listen on" in line
        assert "Address already in use" in line
        assert "another program listens there" in line
        daemon.wait_for_line("robot connected", "cell=blocked")
        daemon.wait_for_line("listening for Modbus", f"listen={HOST}:{other}")
        socket.create_connection((HOST, other)).close()
    daemon.wait_for_line("listening for Modbus", f"listen={HOST}:{plant.modbus}")
    plc = plant.ready_plc()
    assert plc.write_integers(2, 5) == 0
    assert len(daemon.lines("cannot listen on")) == 1
    code, _took = daemon.stop()
    assert code == 0


def test_stops_while_its_port_is_in_use(plant: Plant) -> None:
    with socket.create_server((HOST, plant.modbus)):
        daemon = plant.run(plant.mapping(CELL, free_port()))
        daemon.wait_for_line("cannot listen on")
        code, took = daemon.stop()
    assert code == 0
    assert took < 1


def test_an_address_that_this_machine_has_not(plant: Plant) -> None:
    path = plant.mapping(CELL, free_port())
    path.write_text(path.read_text().replace(f"listen: '{HOST}", "listen: '192.0.2.1"))
    daemon = plant.run(path)
    assert "192.0.2.1" in daemon.wait_for_line("cannot listen on", "no such address")
    assert daemon.stop()[0] == 0


def unreadable(directory: Path) -> Path:
    """A file that nobody can read, the superuser included."""
    path = directory / "secret.yaml"
    path.write_text("gatewayd: 1\n")
    path.chmod(0)
    return Path("/proc/self/mem") if os.access(path, os.R_OK) else path


def test_what_cannot_be_served_is_told_and_the_rest_runs(plant: Plant, tmp_path: Path) -> None:
    simulator = plant.simulator()
    broken = tmp_path / "broken.yaml"
    broken.write_text(
        "gatewayd: 1\ncell: broken\nrobot: {host: 192.0.2.1}\nvariables:\n  x: {robot: no_such_field}\n"
    )
    missing, secret = tmp_path / "missing.yaml", unreadable(tmp_path)
    good = plant.mapping(CELL, simulator.port)
    daemon = plant.daemon(missing, broken, secret, good)
    plc = plant.ready_plc()
    assert plc.write_integers(0, 5) == 0
    assert "No such file" in daemon.wait_for_line("cannot read the mapping file", str(missing))
    assert daemon.lines("cannot read the mapping file", str(secret))
    assert f"at={broken}:5:" in daemon.wait_for_line("error", "no_such_field")
    daemon.wait_for_line("not served", f"gatewayd check {broken}")
    assert "Traceback" not in daemon.text()


@pytest.mark.parametrize("what, code", [("unreadable", 2), ("empty directory", 2), ("strict", 1)])
def test_nothing_to_serve_ends_with_a_code_and_no_traceback(
    plant: Plant, tmp_path: Path, what: str, code: int
) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text("gatewayd: 1\ncell: [\n")
    (tmp_path / "empty").mkdir()
    arguments: dict[str, list[str | Path]] = {
        "unreadable": [unreadable(tmp_path)],
        "empty directory": [tmp_path / "empty"],
        "strict": ["--strict", plant.mapping(CELL, free_port()), broken],
    }
    daemon = plant.run(*arguments[what])
    assert daemon.wait() == code
    assert "Traceback" not in daemon.text()
    assert 1 <= len(daemon.lines("error")) <= 4


def test_suspended_for_a_while(plant: Plant) -> None:
    """A machine that stood still (as virtual ones do) goes on by itself; what it shows then is not old."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    daemon.signal(signal.SIGSTOP)
    began = time.monotonic()
    wait_for(lambda: time.monotonic() - began > 1.5, "1.5 s")
    simulator.do("set output_int_register_1 0")
    daemon.signal(signal.SIGCONT)
    wait_for(lambda: plc.robot_state == 2 and plc.writable, "the robot to be fresh")
    # What comes in the first moment after such a time may have waited, and is refused with 06: a PLC writes again.
    wait_for(lambda: plc.write_integers(2, 89) == 0, "a write to be taken")
    wait_for(lambda: plc.integers(100) == [89], "the echo")
    assert daemon.stop()[0] == 0


def test_two_cells_behind_one_listener(plant: Plant) -> None:
    """Told apart by unit id; losing one robot costs that cell and nothing of the other."""
    left, right = plant.simulator(), plant.simulator()
    directory = plant.directory / "cells"
    directory.mkdir()
    for path in (
        plant.mapping(CELL, left.port, name="left", unit=1),
        plant.mapping(CELL, right.port, name="right", unit=2),
    ):
        path.rename(directory / path.name)
    daemon = plant.daemon(directory)
    one, two = plant.ready_plc(unit=1), plant.ready_plc(unit=2)
    assert one.write_integers(2, 11) == 0
    assert two.write_integers(2, 22) == 0
    wait_for(lambda: (one.integers(100), two.integers(100)) == ([11], [22]), "each robot's echo")
    assert left.integer("input_int_register_1") == 11
    assert plant.plc(unit=3).reading_code(0) == FAILED
    assert one.read(60002, 2) != two.read(60002, 2), "fingerprints differ"
    right.kill()
    wait_for(lambda: two.robot_state == 0, "the loss of the right robot")
    assert two.write_integers(2, 23) == FAILED
    assert one.robot_state == 2
    assert one.write_integers(2, 12) == 0
    wait_for(lambda: one.integers(100) == [12], "the left robot's echo")
    assert len(daemon.lines("listening for Modbus")) == 1


def test_log_formats(plant: Plant) -> None:
    """One JSON object per line; nothing per package."""
    import json

    simulator = plant.simulator()
    daemon = plant.daemon("--log-format", "json", plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    packages = plc.status(15)
    wait_for(lambda: (plc.status(15) - packages) % 65536 > 100, "a hundred packages")
    events = [json.loads(line) for line in daemon.text().splitlines()]
    assert {"time", "level", "event"} <= set.intersection(*(set(event) for event in events))
    assert "robot connected" in [event["event"] for event in events]
    assert len(events) < 12
