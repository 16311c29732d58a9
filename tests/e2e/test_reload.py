"""Another mapping while a robot moves and PLCs read and write: whose values, locks and connections stay."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.e2e.hammer import DOUBLES, INTEGERS
from tests.e2e.plant import Plant
from tests.e2e.plc import HMI, NO_ADDRESS, NO_VALUE, PLC, STRANGER, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, free_port, wait_for

CELL = f"""\
writers: {{plc: {{modbus: {PLC}}}, hmi: {{modbus: {HMI}}}}}
variables:
  held:   {{robot: input_int_register_0, modbus: 0, owner: [plc, hmi], lease: 60s, limits: [0, 1000]}}
  force:  {{robot: input_double_register_0, modbus: 2, owner: [plc, hmi], on_release: -1.5}}
  bit:    {{robot: input_bit_register_33, modbus: 8.1, owner: plc}}
  echo:   {{robot: output_int_register_0, modbus: 100}}
  level:  {{robot: output_double_register_0, modbus: 104}}
"""
MORE = "  again:  {robot: output_int_register_0, modbus: 110}\n"
FRESH = "  fresh:  {robot: output_int_register_7, modbus: 112}\n"
HELD, FORCE, BIT = 1, 2, 3


def reload(daemon: Daemon, count: int) -> str:
    """SIGHUP; the line that says how the `count`-th reload ended."""
    daemon.signal(signal.SIGHUP)
    return daemon.wait_for_line(" reload", count=count)


def without(name: str) -> str:
    return "".join(line for line in CELL.splitlines(keepends=True) if not line.startswith(f"  {name}:"))


class Controlled:
    """A daemon with a control socket, and `gatewayd reload` for it."""

    def __init__(self, plant: Plant, *files: Path) -> None:
        self.socket = plant.directory / "control.sock"
        self.daemon = plant.daemon(*files, "--control", self.socket)

    def reload(self, *args: str) -> subprocess.CompletedProcess[str]:
        wait_for(self.socket.exists, "the control socket")
        command = [sys.executable, "-m", "gatewayd", "reload", "--socket", str(self.socket), *args]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def finish(process: Process) -> list[str]:
    assert process.popen.stdin is not None
    process.popen.stdin.close()
    words = process.answer().split()
    assert words[:1] != ["torn:"], " ".join(words)
    return words


def in_robot(simulator: Simulator) -> tuple[int, float, int]:
    return (
        simulator.integer("input_int_register_0"),
        simulator.number("input_double_register_0"),
        simulator.integer("input_bit_registers32_to_63"),
    )


def write_all(plc: Plc, simulator: Simulator) -> None:
    assert plc.write_integers(0, 77) == 0
    assert plc.write_doubles(2, 9.5) == 0
    assert plc.write(8, [2]) == 0
    wait_for(lambda: in_robot(simulator) == (77, 9.5, 2), "the values in the robot")


def test_reloads_at_full_speed_are_noticed_by_nobody(plant: Plant) -> None:
    """Two readers and a writer without a pause, the robot at 500 Hz, and one reload after another beneath them."""
    cell = f"""\
writers: {{plc: {{modbus: {PLC}, grace: 1min}}, hmi: {{modbus: {HMI}}}}}
variables:
  ints:    {{robot: input_int_register_0..{INTEGERS - 1}, modbus: 0, owner: plc}}
  doubles: {{robot: input_double_register_0..{DOUBLES - 1}, modbus: {2 * INTEGERS}, owner: plc}}
  told:    {{robot: output_double_register_0..{DOUBLES - 1}, modbus: 500}}
  held:    {{robot: input_bit_register_0, modbus: 700.0, owner: hmi, lease: 60s}}
"""
    program = "; ".join(f"output_double_register_{number} = timestamp" for number in range(DOUBLES))
    simulator = plant.simulator("--program", program, frequency=500)
    path = plant.mapping(cell, simulator.port)
    daemon = plant.daemon(path)
    hmi, _present = plant.ready_plc(HMI), plant.plc(PLC)
    assert hmi.write(700, [1]) == 0
    lease = hmi.lease(2 * DOUBLES + INTEGERS + 1)
    writer = plant.start("hammer", HOST, plant.modbus, PLC, "write", 0)
    readers = [
        plant.start("hammer", HOST, plant.modbus, STRANGER, "read", address, 40000) for address in (500, 24)
    ]
    wait_for(lambda: hmi.integers(0)[0] > 0, "the writer")
    for number in range(1, 7):
        more = "".join(
            f"  more{n}: {{robot: output_double_register_{n}, modbus: {800 + 4 * n}}}\n"
            for n in range(number)
        )
        plant.mapping(cell + more, simulator.port)
        line = reload(daemon, number)
        assert "1 variable added" in line
        print(line)
        assert hmi.reading_code(800, 4 * number) == 0
    last = 2 * DOUBLES + INTEGERS + 1
    assert hmi.owner(last) == 2
    assert lease - 20000 < hmi.lease(last) <= lease, "the same lease goes on"
    assert (hmi.status(13), hmi.status(1) & 8) == (1, 8), "one session all along"
    for reader in readers:
        print(*finish(reader))
    written = int(finish(writer)[1])
    wait_for(lambda: simulator.integer("input_int_register_0") == written, "the last value in the robot")
    assert hmi.doubles(24, DOUBLES) == [float(written)] * DOUBLES
    assert len(daemon.lines("robot connected")) == 1
    assert not daemon.lines("writer lost")


def test_a_new_field_costs_one_short_session_change(plant: Plant) -> None:
    """Nobody else loses anything: connection, lock and value are there before, during and after."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    plant.mapping(CELL + FRESH, simulator.port)
    start = time.monotonic()
    reload(daemon, 1)
    assert plc.owner(HELD) == 1
    wait_for(lambda: plc.writable, "the robot to be writable")
    print(f"robot writable again {(time.monotonic() - start) * 1000:.0f} ms after SIGHUP")
    assert (plc.owner(HELD), plc.owner(FORCE), plc.owner(BIT)) == (1, 1, 1)
    assert plc.integers(0) == [77]
    assert in_robot(simulator) == (77, 9.5, 2)
    assert plc.write_integers(0, 78) == 0
    assert plc.reading_code(112, 2) == 0
    assert len(daemon.lines("robot connected")) == 2
    assert not daemon.lines("register unavailable")


def test_limits_change_at_once_for_what_nobody_owns(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 800) == 0
    assert plc.release(HELD) == 0
    plant.mapping(CELL.replace("[0, 1000]", "[0, 100]"), simulator.port)
    assert "1 variable changed" in reload(daemon, 1)
    assert plc.write_integers(0, 800) == NO_VALUE
    assert plc.write_integers(0, 80) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 80, "the value in the robot")
    assert len(daemon.lines("robot connected")) == 1


def test_what_is_owned_is_not_touched_unless_forced(plant: Plant) -> None:
    simulator = plant.simulator()
    controlled = Controlled(plant, plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    plant.mapping(without("force"), simulator.port)
    refused = controlled.reload()
    print(refused.stderr)
    assert refused.returncode == 1
    assert "`force` is owned by plc now and would be removed [release]" in refused.stderr
    assert "--accept release: an owner would lose" in refused.stderr
    assert in_robot(simulator) == (77, 9.5, 2)
    assert plc.doubles(2) == [9.5]

    forced = controlled.reload("--force")
    print(forced.stdout)
    assert forced.returncode == 0
    wait_for(lambda: in_robot(simulator)[1] == -1.5, "its fallback in the robot")
    assert plc.reading_code(2, 4) == NO_ADDRESS
    wait_for(lambda: plc.writable, "the robot to be writable")
    assert (plc.owner(1), plc.owner(2)) == (1, 1), "held and bit"
    assert in_robot(simulator) == (77, -1.5, 2)
    controlled.daemon.wait_for_line("fallback applied", "variable=force", "old=9.5 new=-1.5")

    again = controlled.reload("--json")
    assert json.loads(again.stdout)["result"] == "unchanged"


def test_a_port_moves_when_it_is_forced(plant: Plant) -> None:
    simulator = plant.simulator()
    controlled = Controlled(plant, plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    former, plant.modbus = plant.modbus, free_port()
    plant.mapping(CELL, simulator.port)
    refused = controlled.reload()
    assert refused.returncode == 1
    assert "are owned by plc now and would be released: modbus moves: listen" in refused.stderr
    assert plc.integers(0) == [77]
    assert controlled.reload("--accept", "release").returncode == 0
    with pytest.raises(ConnectionError):
        plc.write_integers(0, 78)
    with pytest.raises(ConnectionError):
        Plc(former)
    moved = plant.plc()
    assert [moved.owner(number) for number in (HELD, FORCE, BIT)] == [0, 0, 0]
    wait_for(lambda: in_robot(simulator) == (0, -1.5, 0), "the fallbacks: the owner lost its connection")
    assert moved.write_integers(0, 5) == 0
    assert moved.status(13) == 1, "the robot's session went on"


def test_another_frequency_is_another_session_and_nothing_else(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    plant.mapping(CELL, simulator.port, frequency=25)
    assert "settings of robot changed" in reload(daemon, 1)
    wait_for(lambda: plc.writable and plc.status(13) == 2, "the second session")
    assert in_robot(simulator) == (77, 9.5, 2)
    assert plc.owner(HELD) == 1
    wait_for(lambda: 200 < plc.status(12) < 300, "25 Hz")


def test_a_broken_file_changes_nothing_and_its_mending_is_taken(plant: Plant) -> None:
    simulator = plant.simulator()
    path = plant.mapping(CELL, simulator.port)
    daemon = plant.daemon(path)
    plc = plant.ready_plc()
    write_all(plc, simulator)
    path.write_text(path.read_text().replace("modbus: 104", "modbus: 101"))
    line = reload(daemon, 1)
    assert "reload failed, the old mapping runs on" in line
    assert "GW214" in line
    assert plc.integers(0) == [77]
    path.write_text("gatewayd: [")
    assert "reload failed" in reload(daemon, 2)
    path.unlink()
    assert "cannot be read" in reload(daemon, 3)
    plant.mapping(CELL + MORE, simulator.port)
    assert "reloaded: cell: 1 variable added" in reload(daemon, 4)
    assert plc.owner(HELD) == 1
    assert plc.reading_code(110, 2) == 0
    assert "Traceback" not in daemon.text()


def test_the_service_manager_hears_of_it(plant: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    """sd_notify(3): RELOADING with the time, then READY, and why the old mapping runs on until that is mended."""
    path = plant.mapping(CELL, free_port())
    address = plant.directory / "notify.sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(address))
        manager.settimeout(15)
        monkeypatch.setenv("NOTIFY_SOCKET", str(address))
        daemon = plant.daemon(path)
        heard: list[str] = []

        def hear(*parts: str) -> str:
            while not heard or not all(part in heard[-1] for part in parts):
                heard.append(manager.recv(4096).decode())
            return heard[-1]

        hear("READY=1")
        path.write_text("gatewayd: [")
        daemon.signal(signal.SIGHUP)
        assert "MONOTONIC_USEC=" in hear("RELOADING=1")
        assert "reload failed, the old mapping runs on" in hear("READY=1", "STATUS=")
        plant.mapping(CELL + MORE, free_port())
        daemon.signal(signal.SIGHUP)
        hear("RELOADING=1")
        assert "reload" not in hear("READY=1", "STATUS=")


def test_the_service_manager_hears_of_an_audit_that_cannot_be_written(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = plant.directory / "notify.sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(address))
        manager.settimeout(15)
        monkeypatch.setenv("NOTIFY_SOCKET", str(address))
        simulator = plant.simulator()
        plant.daemon(
            plant.mapping(CELL, simulator.port), "--audit", plant.directory / "no-such" / "audit.jsonl"
        )
        write_all(plant.ready_plc(), simulator)
        while "the audit file cannot be written" not in manager.recv(4096).decode():
            pass


def test_two_signals_at_once(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    plant.mapping(CELL + MORE, simulator.port)
    daemon.signal(signal.SIGHUP)
    daemon.signal(signal.SIGHUP)
    daemon.wait_for_line("reloaded: cell: 1 variable added")
    plant.mapping(CELL + MORE + FRESH, simulator.port)
    daemon.signal(signal.SIGHUP)
    wait_for(lambda: plc.status(5) == 7, "the seventh variable")
    wait_for(lambda: plc.writable, "the robot to be writable")
    assert plc.owner(HELD) == 1
    code, took = daemon.stop()
    assert (code, took < 1) == (0, True)


def test_a_closed_terminal_is_no_reload(plant: Plant) -> None:
    """In a terminal SIGHUP means a reload while the terminal is there, and the end once it is gone."""
    path = plant.mapping(CELL, free_port())
    terminal, own = os.openpty()
    command = [sys.executable, "-m", "gatewayd", "run", str(path), "--control", "none"]
    root = Path(__file__).parents[2]
    log = plant.directory / "terminal.log"
    with log.open("wb") as stream:
        popen = subprocess.Popen(command, stdin=own, stderr=stream, start_new_session=True, cwd=root)
    os.close(own)
    try:
        wait_for(lambda: "listening for Modbus" in log.read_text(), "the daemon to listen")
        popen.send_signal(signal.SIGHUP)
        wait_for(lambda: "nothing has changed" in log.read_text(), "a reload")
        os.close(terminal)
        popen.send_signal(signal.SIGHUP)
        assert popen.wait(15) == 0
        assert "stopped" in log.read_text()
    finally:
        popen.kill()
        popen.wait()


def test_a_reload_while_the_robot_is_away(plant: Plant) -> None:
    """What fell due meanwhile is given when it is back, by the new mapping."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    write_all(plc, simulator)
    simulator.signal(signal.SIGSTOP)
    wait_for(lambda: plc.robot_state == 0, "the loss of the robot")
    assert plc.release(FORCE) == 0
    plant.mapping(CELL + FRESH, simulator.port)
    assert "1 variable added" in reload(daemon, 1)
    assert (plc.owner(HELD), plc.owner(FORCE), plc.robot_state) == (1, 0, 0)
    simulator.signal(signal.SIGCONT)
    wait_for(lambda: plc.writable, "the robot to be writable")
    wait_for(lambda: in_robot(simulator) == (77, -1.5, 2), "the fallback that was due")
    assert plc.write_integers(0, 79) == 0


def test_cells_come_and_go_with_the_files_of_a_directory(plant: Plant) -> None:
    simulator = plant.simulator()
    first = plant.mapping(CELL, simulator.port, name="first", modbus_options=", default_unit: true")
    daemon = plant.daemon(plant.directory)
    plc = plant.ready_plc()
    assert plc.write_integers(0, 77) == 0
    second = plant.mapping(CELL, free_port(), name="second", unit=2)
    assert "second: new cell" in reload(daemon, 1)
    other = plant.plc(unit=2)
    assert other.robot_state == 0
    second.unlink()
    assert "second: the whole cell would be gone" in reload(daemon, 2)
    assert first.exists()
    assert plc.owner(HELD) == 1


def test_a_reload_keeps_a_plc_waiting_for_no_longer_than_a_few_packages(plant: Plant) -> None:
    """The files are checked beside the loop; the longest answer is printed, and bounded generously."""
    simulator = plant.simulator(frequency=500)
    full = (Path(__file__).parents[2] / "mappings" / "full-image.yaml").read_text()
    variables = full[full.index("\nvariables:") :]
    writers = f"writers: {{plc: {{modbus: {PLC}}}}}"
    daemon = plant.daemon(plant.mapping(writers + variables, simulator.port))
    plc = plant.ready_plc()
    plant.mapping(
        writers + variables + "\n  again: {robot: output_int_register_0, modbus: 1900}\n", simulator.port
    )
    daemon.signal(signal.SIGHUP)
    longest = 0.0
    while not daemon.lines(" reload"):
        for _ in range(20):
            start = time.monotonic()
            plc.read(1200, 96)
            longest = max(longest, time.monotonic() - start)
    print(f"longest answer during a reload of {plc.status(5)} variables: {longest * 1000:.1f} ms")
    print(daemon.lines(" reload")[0])
    assert "1 variable added" in daemon.lines(" reload")[0]
    assert longest < 0.5
