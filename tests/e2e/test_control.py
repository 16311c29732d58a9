"""A maintenance crew beside a running cell: real daemon, real PLC, the commands as they are typed."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import BUSY, PLC, Plc
from tests.e2e.processes import Daemon, Simulator, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
variables:
  number: {{robot: input_int_register_0,  modbus: 0, owner: plc, on_release: 5}}
  lamp:   {{robot: input_bit_register_0,  modbus: 4.0, owner: plc}}
  echo:   {{robot: output_int_register_0, modbus: 100}}
  flag:   {{robot: output_bit_register_0, modbus: 104.0}}
"""
NUMBER, LAMP, ECHO, FLAG = range(1, 5)
OPERATOR = 255
FORCED = 4
QUALITY = 63263
"""Address of the quality table, less 1 for counting from 1."""

Cell = tuple[Simulator, Daemon, Plc, Path]


@pytest.fixture
def cell(plant: Plant) -> Cell:
    simulator = plant.simulator()
    socket = plant.directory / "control.sock"
    mapping = plant.mapping(CELL, simulator.port)
    daemon = plant.daemon(mapping, "--control", socket, "--audit", plant.directory / "audit.jsonl")
    plc = plant.ready_plc()
    daemon.wait_for_line("listening for control")
    return simulator, daemon, plc, socket


def gatewayd(socket: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "gatewayd", *arguments, "--socket", str(socket)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)


def test_a_forced_input_reaches_the_robot_and_the_plc_is_refused_meanwhile(cell: Cell) -> None:
    simulator, daemon, plc, socket = cell
    assert plc.write_integers(0, 11) == 0
    done = gatewayd(socket, "force", "number", "42", "--for", "30s")
    assert done.returncode == 0, done.stderr
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "the robot to have the forced value")
    assert plc.write_integers(0, 12) == BUSY
    assert plc.owner(NUMBER) == OPERATOR
    assert plc.read(QUALITY + NUMBER) == [FORCED]
    assert gatewayd(socket, "status").returncode == 1
    daemon.wait_for_line("value forced", "variable=number", "writer=operator")

    assert gatewayd(socket, "unforce", "number").returncode == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 5, "the release fallback")
    assert plc.write_integers(0, 13) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 13, "the PLC to rule again")


def test_a_force_ends_by_itself(cell: Cell) -> None:
    simulator, _daemon, plc, socket = cell
    assert gatewayd(socket, "force", "number", "42", "--for", "300ms").returncode == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 5, "the release fallback")
    assert plc.owner(NUMBER) == 0


def test_a_forced_output_is_seen_by_the_plc_through_every_package_and_then_no_more(cell: Cell) -> None:
    simulator, _daemon, plc, socket = cell
    assert plc.write_integers(0, 11) == 0
    wait_for(lambda: plc.integers(100) == [11], "the robot's echo")
    for name, value in (("echo", "99"), ("flag", "on")):
        assert gatewayd(socket, "force", name, value, "--for", "60s").returncode == 0
    assert plc.integers(100) == [99]
    assert plc.read(104) == [1]
    assert plc.write_integers(0, 12) == 0
    wait_for(lambda: simulator.integer("output_int_register_0") == 12, "the robot to go on")
    assert plc.integers(100) == [99]
    assert plc.read(QUALITY + ECHO) == [FORCED]
    assert gatewayd(socket, "unforce", "--all").returncode == 0
    assert plc.integers(100) == [12]
    assert plc.read(104) == [0]
    assert plc.read(QUALITY + ECHO, 2) == [0, 0]


def test_a_taken_lock_starts_from_its_fallback_and_is_given_back(cell: Cell) -> None:
    """Nobody inherits the command of a PLC that the lock was taken from."""
    simulator, _daemon, plc, socket = cell
    assert plc.write_integers(0, 11) == 0
    assert gatewayd(socket, "locks", "take", "number").returncode == 0
    assert plc.write_integers(0, 12) == BUSY
    wait_for(lambda: simulator.integer("input_int_register_0") == 5, "the fallback in the robot")
    assert gatewayd(socket, "locks", "release", "number").returncode == 0
    assert plc.write_integers(0, 13) == 0


def test_everything_is_in_the_audit_file(cell: Cell) -> None:
    _simulator, daemon, plc, socket = cell
    assert plc.write_integers(0, 11) == 0
    assert gatewayd(socket, "force", "number", "42", "--for", "30s").returncode == 0
    assert plc.write_integers(0, 12) == BUSY
    assert daemon.stop()[0] == 0
    records = [json.loads(line) for line in (socket.parent / "audit.jsonl").read_text().splitlines()]
    audited = [(each["what"], each.get("writer"), each.get("old"), each.get("new")) for each in records]
    for expected in (
        ("write accepted", "plc", 0, 11),
        ("lock taken over", "operator", None, None),
        ("value forced", "operator", 11, 42),
        ("write refused", "plc", 42, 12),
        ("force ended", "operator", 42, None),
        ("fallback applied", "gateway", 42, 5),
    ):
        assert expected in audited


def test_two_daemons_one_socket(cell: Cell, plant: Plant) -> None:
    """The second one serves its cell all the same, says why it has no socket, and gets it when the first one ends."""
    simulator, first, _plc, socket = cell
    other = plant.mapping(
        "variables: {echo: {robot: output_int_register_1, modbus: 0}}\n", simulator.port, name="b", unit=2
    )
    other.write_text(other.read_text().replace(f":{plant.modbus}'", f":{plant.modbus + 500}'"))
    second = plant.daemon(other, "--control", socket)
    second.wait_for_line("no control socket", "another gatewayd answers there")
    assert first.stop()[0] == 0
    second.wait_for_line("listening for control")
    assert json.loads(gatewayd(socket, "status", "--json").stdout)["cells"][0]["name"] == "b"


def test_the_end_of_the_daemon_releases_what_the_operator_holds(cell: Cell) -> None:
    simulator, daemon, _plc, socket = cell
    assert gatewayd(socket, "force", "number", "42", "--for", "1h").returncode == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "the forced value")
    assert daemon.stop()[0] == 0
    assert simulator.integer("input_int_register_0") == 5
    assert not socket.exists()


def test_a_killed_daemon_leaves_a_socket_that_the_next_one_replaces(cell: Cell, plant: Plant) -> None:
    simulator, daemon, _plc, socket = cell
    daemon.kill()
    assert socket.exists()
    done = gatewayd(socket, "status")
    assert (done.returncode, "any more: start it again" in done.stderr) == (2, True)
    again = plant.run(plant.mapping(CELL, simulator.port), "--control", socket)
    again.wait_for_line("listening for control")
    assert gatewayd(socket, "events").returncode == 0


def test_the_gateway_serves_before_it_imports_http(cell: Cell) -> None:
    _simulator, daemon, _plc, _socket = cell
    lines = daemon.text().splitlines()
    serving = next(n for n, line in enumerate(lines) if "listening for Modbus" in line)
    control = next(n for n, line in enumerate(lines) if "listening for control" in line)
    assert serving < control


def test_events_are_followed_as_they_come(cell: Cell) -> None:
    simulator, _daemon, plc, socket = cell
    command = [
        sys.executable,
        "-m",
        "gatewayd",
        "events",
        "--follow",
        "--json",
        "-n",
        "1",
        "--socket",
        str(socket),
    ]
    following = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert following.stdout is not None
        # The newest event so far shows that the command is there.
        assert json.loads(following.stdout.readline())["event"]
        assert plc.write_integers(0, 11) == 0
        assert json.loads(following.stdout.readline())["event"] == "lock acquired"
        simulator.kill()
        # On a machine that stands still for a moment, values may be stale before.
        assert any("robot lost" in json.loads(line)["event"] for line in following.stdout)
    finally:
        following.kill()
        following.communicate()


def test_a_command_that_waited_while_the_gateway_stood_still_is_not_carried_out(cell: Cell) -> None:
    """The crew gave up after seconds; the gateway goes on, and what they asked for then is no longer meant."""
    simulator, daemon, plc, socket = cell
    assert plc.write_integers(0, 11) == 0
    daemon.signal(signal.SIGSTOP)
    command = [sys.executable, "-m", "gatewayd", "force", "number", "42", "--socket", str(socket)]
    waiting = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: _waits_in(socket), "the command to be sent")
    begin = time.monotonic()
    wait_for(lambda: time.monotonic() - begin > 0.7, "time to pass")
    daemon.signal(signal.SIGCONT)
    _output, errors = waiting.communicate(timeout=30)
    assert waiting.returncode == 1, errors
    assert re.search(r"the gateway stood still for \d+\.\d s; repeat the command", errors), errors
    assert not daemon.lines("value forced")
    wait_for(
        lambda: gatewayd(socket, "force", "number", "42").returncode == 0, "the repeated command to count"
    )
    wait_for(lambda: simulator.integer("input_int_register_0") == 42, "the robot to have the forced value")


def _waits_in(path: Path) -> bool:
    """Whether somebody waits to be accepted there, with what was sent: as the kernel lists it (state 02)."""
    lines = Path("/proc/net/unix").read_text("ascii").splitlines()
    return any(line.split()[5] == "02" and line.endswith(str(path)) for line in lines)
