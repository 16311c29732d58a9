"""Programs started from a PLC by the dashboard server, and everything that must not start one."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import HMI, PLC, Plc
from tests.e2e.processes import Daemon, Simulator, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}, grace: 20s}}
  hmi: {{modbus: {HMI}}}
variables:
  start:     {{dashboard: play, modbus: [0.0, 7.0], owner: [hmi, plc], lease: 60s}}
  halt:      {{dashboard: stop, modbus: 1.0, owner: plc}}
  hold:      {{dashboard: pause, modbus: 2.0, owner: plc}}
  program:   {{dashboard: load, modbus: 3, owner: plc}}
  unlock:    {{dashboard: unlock, modbus: 4.0, owner: plc}}
  power:     {{dashboard: power, modbus: 5.0, owner: plc}}
  brakes:    {{dashboard: brake_release, modbus: 6.0, owner: plc}}
  neighbour: {{robot: input_bit_register_0, modbus: 7.1, owner: plc}}
  result:    {{dashboard: result, modbus: {{holding: 100, type: uint16}}}}
  mode:      {{dashboard: robot_mode, modbus: {{holding: 101, type: int16}}}}
  state:     {{dashboard: program_state, modbus: {{holding: 102, type: uint16}}}}
  loaded:    {{dashboard: loaded, modbus: {{holding: 103, type: uint16}}}}
  safety:    {{dashboard: safety_status, modbus: {{holding: 104, type: uint16}}}}
  remote:    {{dashboard: remote_control, modbus: 105.0}}
  up:        {{dashboard: connected, modbus: 106.0}}
"""
START, HALT, PAUSE, PROGRAM, UNLOCK, POWER, BRAKES, SHARED = range(8)
RESULT, MODE, STATE, LOADED, SAFETY, REMOTE, UP = range(100, 107)
DONE, FAILED, LOCAL, NO_PROGRAM, NOT_FOUND, LOAD_ERROR, TOO_SOON = 2, 3, 4, 5, 6, 7, 8
NO_SUCH_NUMBER, NOT_CLEARED, IMPLIED = 15, 16, 17
STOPPED, PLAYING, PAUSED = 1, 2, 4


@dataclass
class Cell:
    """A robot with a dashboard server, a gateway, and the way to both."""

    plant: Plant
    simulator: Simulator
    daemon: Daemon
    socket: Path

    def sent(self, line: str) -> int:
        """How often the robot was told this."""
        return len(self.simulator.lines(f"dashboard: {line}: "))

    def gatewayd(self, *words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "gatewayd", *words, "--socket", str(self.socket)]
        return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def cell(lasting_plant: Plant) -> Cell:
    plant = lasting_plant
    simulator = plant.simulator("--dashboard", "0")
    port = int(simulator.answer().rpartition(":")[2])
    programs = "{1: pick.urp, 2: place.urp, 3: missing.urp}"
    path = plant.mapping(
        CELL,
        simulator.port,
        robot_options=f", dashboard: {{port: {port}, poll: 100ms, programs: {programs}}}",
    )
    socket = plant.directory / "control.sock"
    daemon = plant.daemon(path, "--control", socket)
    daemon.wait_for_line("listening for control")
    return Cell(plant, simulator, daemon, socket)


@pytest.fixture
def plc(cell: Cell) -> Plc:
    """The PLC on a connection of its own, everything up, its commands at rest."""
    plc = cell.plant.ready_plc()
    wait_for(lambda: plc.read(UP) == [1], "the dashboard server")
    for register in range(SHARED):
        assert plc.write_one(register, 0) == 0
    return plc


def give(plc: Plc, register: int, value: int = 1) -> int:
    """Give a command as it has to be; the result."""
    assert plc.write_one(register, 0) == 0
    assert plc.write_one(register, value) == 0
    wait_for(lambda: plc.read(RESULT) != [1], "the robot's answer")
    return plc.read(RESULT)[0]


def test_a_program_is_stopped_loaded_started_and_paused(cell: Cell, plc: Plc) -> None:
    wait_for(lambda: plc.read(STATE) == [PLAYING], "the robot's state")
    assert plc.read(MODE) == [7]
    assert plc.read(SAFETY) == [1]
    assert plc.read(REMOTE) == [1]
    assert give(plc, HALT) == DONE
    wait_for(lambda: plc.read(STATE) == [STOPPED], "the end of the program")
    assert give(plc, PROGRAM, 2) == DONE
    wait_for(lambda: plc.read(LOADED) == [2], "the other program")
    assert give(plc, START) == DONE
    wait_for(lambda: plc.read(STATE) == [PLAYING], "the program to run")
    before = cell.sent("play")
    for _ in range(3):
        assert plc.write_one(START, 1) == 0
    assert give(plc, PAUSE) == DONE
    wait_for(lambda: plc.read(STATE) == [PAUSED], "the pause")
    assert cell.sent("play") == before, "what is held does nothing"
    cell.daemon.wait_for_line("command sent", "variable=start", "writer=plc")
    cell.daemon.wait_for_line("command carried out", "variable=start", 'detail="Starting program"')
    assert plc.status(53) == DONE
    assert plc.status(52) == 3


def test_what_cannot_be_is_refused_with_the_reason(cell: Cell, plc: Plc) -> None:
    assert give(plc, PROGRAM, 1) == LOAD_ERROR, "while one is paused"
    give(plc, HALT)
    wait_for(lambda: plc.read(STATE) == [STOPPED], "the end of the program")
    assert give(plc, PROGRAM, 3) == NOT_FOUND
    assert give(plc, HALT) == FAILED
    sent = cell.sent("play")
    cell.simulator.do("load none")
    wait_for(lambda: plc.read(LOADED) == [0], "the gateway to know")
    assert give(plc, START) == NO_PROGRAM
    cell.simulator.do("load pick.urp")
    wait_for(lambda: plc.read(LOADED) == [1], "the gateway to know")
    cell.simulator.do("remote off")
    wait_for(lambda: plc.read(REMOTE) == [0], "local control")
    assert plc.status(52) == 2
    assert give(plc, START) == LOCAL
    cell.simulator.do("remote on")
    wait_for(lambda: plc.read(REMOTE) == [1], "remote control")
    wait_for(lambda: plc.read(UP) == [1], "another connection")
    assert cell.sent("play") == sent, "known refusals are not asked"
    cell.daemon.wait_for_line("command refused", "variable=start", "local control")
    assert give(plc, START) == DONE


def test_an_arm_is_switched_on_and_a_protective_stop_unlocked(cell: Cell, plc: Plc) -> None:
    cell.simulator.do("safety protective-stop")
    wait_for(lambda: plc.read(SAFETY) == [3], "the protective stop")
    assert give(plc, UNLOCK) == TOO_SOON
    cell.simulator.do("power off")
    wait_for(lambda: plc.read(MODE) == [3], "the power to be off")
    wait_for(lambda: give(plc, UNLOCK) == DONE, "the first 5 s to end")
    wait_for(lambda: plc.read(SAFETY) == [1], "the end of the stop")
    assert give(plc, POWER) == DONE
    wait_for(lambda: plc.read(MODE) == [5], "the power to be on")
    assert give(plc, BRAKES) == DONE
    wait_for(lambda: plc.read(MODE) == [7], "the brakes")


# -- what must not act: 0, something, and 1 ------------------------------------------------------------------------


def _adoption(cell: Cell, plc: Plc) -> Plc:
    """The robot restarts, and its inputs are adopted."""
    sessions = plc.status(13)
    cell.simulator.do("restart")
    wait_for(lambda: plc.status(13) > sessions and plc.writable and plc.read(UP) == [1], "the robot again")
    return plc


def _robot_again(cell: Cell, plc: Plc) -> Plc:
    sessions = plc.status(13)
    cell.simulator.do("drop-clients")
    wait_for(lambda: plc.status(13) > sessions and plc.writable, "another session")
    return plc


def _dashboard_again(cell: Cell, plc: Plc) -> Plc:
    cell.simulator.do("drop-dashboard")
    wait_for(lambda: plc.read(UP) == [0], "the loss")
    wait_for(lambda: plc.read(UP) == [1], "the dashboard server again")
    return plc


def _plc_again(cell: Cell, plc: Plc) -> Plc:
    """Another connection within the grace: the lock is still the PLC's."""
    plc.close()
    again = cell.plant.ready_plc()
    assert again.owner(START + 1) == 1
    return again


def _takeover(cell: Cell, plc: Plc) -> Plc:
    """The 1 comes from another writer, who ranks above."""
    assert plc.owner(START + 1) == 1
    return cell.plant.plc(HMI)


def _fallback(_cell: Cell, plc: Plc) -> Plc:
    """The lock is given back, the command falls back, and the same writer writes 1."""
    assert plc.release(START + 1) == 0
    return plc


def _operator(cell: Cell, plc: Plc) -> Plc:
    assert cell.gatewayd("locks", "take", "start").returncode == 0
    assert cell.gatewayd("locks", "release", "start").returncode == 0
    return plc


def _reload(cell: Cell, plc: Plc) -> Plc:
    """To a mapping with another fallback of a state: session, connection, lock and owner stay."""
    file = cell.plant.directory / "cell.yaml"
    file.write_text(file.read_text().replace("safety_status,", "safety_status, on_stale: hold,"))
    done = cell.gatewayd("reload", "--accept", "weakening")
    assert done.returncode == 0, done.stdout + done.stderr
    assert plc.owner(START + 1) == 1
    return plc


WAYS: dict[str, Callable[[Cell, Plc], Plc]] = {
    "takeover": _takeover,
    "fallback": _fallback,
    "operator": _operator,
    "reload": _reload,
    "reconnect of the writer": _plc_again,
    "reconnect of the dashboard": _dashboard_again,
    "reconnect of the robot": _robot_again,
    "adoption": _adoption,
}


@pytest.mark.parametrize("way", WAYS)
def test_nothing_is_started(cell: Cell, plc: Plc, way: str) -> None:
    before = cell.sent("play")
    writer = WAYS[way](cell, plc)
    assert writer.write_one(START, 1) == 0
    wait_for(lambda: writer.read(RESULT) == [NOT_CLEARED], "the refusal")
    assert writer.status(53) == NOT_CLEARED
    assert cell.sent("play") == before
    cell.daemon.wait_for_line("command refused", "variable=start")
    # The same writer gives it as it has to be, so that this was about the way and nothing else.
    assert writer.write_one(START, 0) == 0
    assert writer.write_one(START, 1) == 0
    wait_for(lambda: cell.sent("play") == before + 1, "the command")
    if way == "takeover":
        writer.release(START + 1)
        writer.close()


def test_an_implied_bit_starts_nothing(cell: Cell, plc: Plc) -> None:
    before = cell.sent("play")
    assert plc.write(SHARED, [0b01]) == 0
    wait_for(lambda: plc.read(RESULT) == [IMPLIED], "the refusal")
    assert cell.sent("play") == before


def test_a_forced_command_starts_nothing_and_is_refused(cell: Cell, plc: Plc) -> None:
    before = cell.sent("play")
    done = cell.gatewayd("force", "start", "true", "--for", "5s")
    assert done.returncode == 1, done.stdout
    assert plc.read(START) == [0]
    assert cell.sent("play") == before


def test_a_start_of_the_gateway_starts_nothing(cell: Cell, plc: Plc) -> None:
    assert give(plc, START) in (DONE, FAILED)
    before = cell.sent("play")
    arguments = cell.daemon.popen.args
    assert isinstance(arguments, list)
    cell.daemon.stop()
    plc.close()
    cell.daemon = cell.plant.daemon(*arguments[4:])
    again = cell.plant.ready_plc()
    wait_for(lambda: again.read(UP) == [1], "the dashboard server")
    assert again.write_one(START, 1) == 0
    wait_for(lambda: again.read(RESULT) == [NOT_CLEARED], "the refusal")
    assert cell.sent("play") == before
