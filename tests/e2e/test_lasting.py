"""What a gateway lives through in years: peers that hang, many at once, a suspended process, clocks, disks."""

from __future__ import annotations

import ast
import fcntl
import json
import signal
import socket
import struct
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, STRANGER
from tests.e2e.processes import HOST, Process, free_port, wait_for

PACKAGE = Path(__file__).parents[2] / "gatewayd"
CELL = f"""\
writers: {{plc: {{modbus: {PLC}, timeout: 2s}}}}
variables:
  number: {{robot: input_int_register_0,  modbus: 0, owner: plc, lease: 2s}}
  echo:   {{robot: output_int_register_0, modbus: 100}}
  moving: {{robot: output_int_register_5, modbus: 102}}
"""
FRESH = 2
STATE = 60007
QUICK = 0.5
"""Seconds for an answer to a PLC, whatever others do."""

ALLOWED, BACKLOG = 32, 100
"""Connections of a listener; those that asyncio accepts in one go, before the ones too many are closed."""

OTHER_CLOCK = """\
import random, runpy, sys, time
real, chance = time.time, random.Random(5)
time.time = lambda: real() + chance.choice((-4e8, -3600, 0, 3600, 4e8))
sys.argv = ["gatewayd", *sys.argv[1:]]
runpy.run_module("gatewayd", run_name="__main__")
"""
"""The daemon under a wall clock that steps by an hour or by years each time that it is asked."""

SUSPENDED_MACHINE = """\
import runpy, sys, time
path, sys.argv = sys.argv[1], ["gatewayd", *sys.argv[2:]]
real = time.clock_gettime
def asleep():
    return float(open(path).read())
time.clock_gettime = lambda which: real(which) + (asleep() if which == time.CLOCK_BOOTTIME else 0.0)
runpy.run_module("gatewayd", run_name="__main__")
"""
"""The daemon on a machine that was suspended for as many seconds as a file says: CLOCK_MONOTONIC stood still."""

WALL_CLOCK = {
    "cli/events": "what `--since 10min` means",
    "cli/rtde/robot_source": "the time of a package in a recording",
    "control/server": "the time in answers",
    "demo/snapshot": "the time on the screen",
    "audit/trail": "the time of a record",
    "cli/token": "when tokens end",
    "links/modbus_server/doctor": "when certificates end",
    "links/modbus_server/renewal": "when certificates end",
    "links/modbus_server/rules/certificates": "when certificates end",
    "links/modbus_server/secure_connection": "when certificates end",
    "links/mqtt/json_link": "the time of a value in a message",
    "links/mqtt/node": "the time of a value in a message",
    "service/assemble": "when tokens and certificates end",
    "web/guard": "when tokens end",
    "web/launch": "when tokens and certificates end",
    "web/view": "the time on the page",
}
"""The only modules that may ask the wall clock, and what for."""
WALL_CLOCK_CALLS = {("time", "time"), ("time", "time_ns"), ("datetime", "now"), ("datetime", "utcnow")}


def descriptors(process: Process) -> int:
    return sum(1 for _ in Path(f"/proc/{process.pid}/fd").iterdir())


def connect(plant: Plant, source: str = STRANGER) -> socket.socket:
    return socket.create_connection((HOST, plant.modbus), 10, (source, 0))


def is_listening(plant: Plant) -> bool:
    try:
        connect(plant).close()
    except ConnectionError:
        return False
    return True


def read_request(address: int, count: int) -> bytes:
    return struct.pack(">HHHBBHH", address & 0xFF, 0, 6, 1, 3, address, count)


def words(peer: socket.socket, count: int) -> tuple[int, ...]:
    """The registers of the next answer."""
    answer = b""
    while len(answer) < 9 + 2 * count:
        got = peer.recv(9 + 2 * count - len(answer))
        assert got, "the gateway closed the connection"
        answer += got
    return struct.unpack(f">{count}H", answer[9:])


def test_a_robot_that_accepts_and_never_reads_stops_nobody(plant: Plant) -> None:
    """Something listens where the robot should be, and says nothing. Then the robot is there after all."""
    port = free_port()
    with socket.create_server((HOST, port)):
        daemon = plant.daemon(plant.mapping(CELL, port))
        plc = plant.plc()
        before = descriptors(daemon)
        end = time.monotonic() + 3
        slowest = 0.0
        while time.monotonic() < end:
            asked = time.monotonic()
            assert plc.robot_state in (0, 1)
            assert plc.write_integers(0, 5) != 0
            slowest = max(slowest, time.monotonic() - asked)
            time.sleep(0.01)
        assert slowest < QUICK
        assert descriptors(daemon) <= before + 2
    plant.simulator(port=port)
    wait_for(lambda: plc.writable and plc.write_integers(0, 6) == 0, "the robot")


def test_a_robot_that_reads_no_more_costs_no_memory(plant: Plant) -> None:
    """It hangs in the middle of everything, and the PLC writes on as fast as it can."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 1) == 0
    before = daemon.resident_kilobytes()
    simulator.signal(signal.SIGSTOP)
    end, accepted, tried = time.monotonic() + 2, 0, 0
    while time.monotonic() < end:
        tried += 1
        accepted += plc.write_integers(0, tried) == 0
    assert plc.robot_state != FRESH
    grown = daemon.resident_kilobytes() - before
    simulator.signal(signal.SIGCONT)
    print(f"{accepted} of {tried} writes accepted beside a hanging robot, {grown} kB more")
    assert grown < 4096
    wait_for(lambda: plc.writable and plc.write_integers(0, 42) == 0, "the robot to go on")
    wait_for(lambda: plc.integers(100) == [42], "its echo")


def test_a_thousand_connections_in_a_few_seconds(plant: Plant) -> None:
    """Thirty-two are allowed. The PLC that was there works on, and no descriptor is left."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    before = descriptors(daemon)
    begin, slowest, most = time.monotonic(), 0.0, 0
    for wave in range(4):
        with ExitStack() as peers:
            for _ in range(250):
                peers.enter_context(connect(plant))
            asked = time.monotonic()
            assert plc.write_integers(0, wave) == 0
            slowest = max(slowest, time.monotonic() - asked)
            most = max(most, descriptors(daemon))
    took = time.monotonic() - begin
    wait_for(lambda: descriptors(daemon) <= before, "the descriptors to be given back")
    print(f"1000 connections in {took:.1f} s; the PLC waited {slowest * 1000:.0f} ms; {most} descriptors")
    assert slowest < QUICK
    assert most <= before + ALLOWED + 2 * BACKLOG
    assert daemon.running
    assert "Traceback" not in daemon.text()


def test_half_open_peers_are_ended_by_the_idle_time_out(plant: Plant) -> None:
    simulator = plant.simulator()
    mapping = plant.mapping(CELL, simulator.port, modbus_options=", idle_timeout: 1s")
    daemon = plant.daemon(mapping)
    plc = plant.ready_plc()
    before = descriptors(daemon)
    with ExitStack() as peers:
        silent = [peers.enter_context(connect(plant)) for _ in range(20)]
        for number, peer in enumerate(silent):
            peer.sendall(read_request(STATE, 1)[: number % 12])

        def rid_of_them() -> bool:
            return plc.robot_state == FRESH and descriptors(daemon) <= before

        took = wait_for(rid_of_them, "the end of the half-open connections")
    print(f"20 half-open connections gone after {took:.1f} s")
    assert plc.write_integers(0, 3) == 0


def test_after_a_suspension_nothing_is_told_fresh_that_is_not(plant: Plant) -> None:
    """The robot falls silent, then the process is stopped. A request that waits meanwhile is answered "not fresh"."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    for _ in range(3):
        with connect(plant, PLC) as peer:
            simulator.do("silence on")
            time.sleep(0.1)
            daemon.signal(signal.SIGSTOP)
            peer.sendall(read_request(STATE, 1))
            time.sleep(1)
            daemon.signal(signal.SIGCONT)
            (state,) = words(peer, 1)
            simulator.do("silence off")
        assert state != FRESH
        wait_for(lambda: plc.robot_state == FRESH, "fresh values")


def test_after_a_suspension_a_fresh_value_is_a_new_one(plant: Plant) -> None:
    """The robot goes on while the process is stopped for two seconds: what it said at the beginning is old."""
    simulator = plant.simulator("--program", "output_int_register_0 = input_int_register_0")
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc()
    daemon.signal(signal.SIGSTOP)
    with connect(plant, PLC) as peer:
        peer.sendall(read_request(STATE, 1) + read_request(102, 2))
        time.sleep(1)
        simulator.do("set output_int_register_5 4711")
        time.sleep(1)
        daemon.signal(signal.SIGCONT)
        begin = time.monotonic()
        (state,), value = words(peer, 1), words(peer, 2)
        assert state != FRESH or value == (0, 4711)
    wait_for(lambda: plc.robot_state == FRESH and plc.integers(102) == [4711], "the new value")
    print(f"fresh {1000 * (time.monotonic() - begin):.0f} ms after the end of the suspension")


def test_steps_of_the_wall_clock_matter_to_nobody(plant: Plant) -> None:
    simulator = plant.simulator()
    mapping = plant.mapping(CELL, simulator.port)
    audit = plant.directory / "audit.jsonl"
    log = plant.directory / "stepping.log"
    arguments = [
        "run",
        str(mapping),
        "--control",
        str(plant.directory / "control.sock"),
        "--audit",
        str(audit),
    ]
    daemon = Process([sys.executable, "-c", OTHER_CLOCK, *arguments], log)
    try:
        daemon.wait_for_line("listening for Modbus")
        plc = plant.ready_plc()
        end = time.monotonic() + 2
        number = 0
        while time.monotonic() < end:
            number += 1
            assert plc.write_integers(0, number) == 0
            assert plc.robot_state == FRESH
            assert plc.owner(1) == 1
            assert 1000 < plc.lease(1) <= 2000
        daemon.signal(signal.SIGTERM)
        assert daemon.wait() == 0
    finally:
        daemon.kill()
        print(daemon.text()[-4000:])
    assert "Traceback" not in daemon.text()
    assert not daemon.lines("writer lost", "time-out")
    years = {json.loads(line)["time"][:4] for line in audit.read_text().splitlines()}
    assert len(years) > 1, "the clock did not step"


def test_leases_age_while_the_machine_is_suspended(plant: Plant) -> None:
    """Two hours of suspension are two hours: the lease has ended, though no clock of the process went on."""
    simulator = plant.simulator()
    text = CELL.replace("lease: 2s", "lease: 1h").replace(", timeout: 2s", "")
    mapping = plant.mapping(text, simulator.port)
    asleep = plant.directory / "asleep"
    asleep.write_text("0")
    command = [sys.executable, "-c", SUSPENDED_MACHINE, str(asleep), "run", str(mapping), "--control", "none"]
    daemon = Process(command, plant.directory / "suspended.log")
    try:
        daemon.wait_for_line("listening for Modbus")
        plc = plant.ready_plc()
        assert plc.write_integers(0, 7) == 0
        assert plc.owner(1) == 1
        wait_for(lambda: simulator.integer("input_int_register_0") == 7, "the command to arrive")
        renamed = asleep.with_suffix(".new")
        renamed.write_text("7200")
        renamed.replace(asleep)
        wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the fallback to arrive")
        assert plant.plc().owner(1) == 0
        daemon.wait_for_line("gateway stood still", "7200")
    finally:
        daemon.kill()


def test_only_what_is_shown_to_people_asks_the_wall_clock() -> None:
    """Freshness, leases and time-outs count on the monotonic clock alone."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            asks = (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and (node.value.id, node.attr) in WALL_CLOCK_CALLS
            )
            imports = (
                isinstance(node, ast.ImportFrom)
                and node.module == "time"
                and any(alias.name.startswith("time") for alias in node.names)
            )
            if asks or imports:
                found.add(path.relative_to(PACKAGE).with_suffix("").as_posix())
    assert found == set(WALL_CLOCK)


def test_a_log_that_nobody_reads_stops_nobody(plant: Plant) -> None:
    """Standard error is a pipe, full after some hundred locks; the daemon goes on, and ends when told to."""
    simulator = plant.simulator()
    mapping = plant.mapping(CELL, simulator.port)
    command = [
        sys.executable,
        "-m",
        "gatewayd",
        "run",
        str(mapping),
        "--control",
        "none",
        "--log-level",
        "debug",
    ]
    daemon = subprocess.Popen(command, stderr=subprocess.PIPE, cwd=PACKAGE.parent)
    assert daemon.stderr is not None
    capacity = fcntl.fcntl(daemon.stderr, fcntl.F_GETPIPE_SZ)
    try:
        wait_for(lambda: is_listening(plant), "the daemon to listen")
        plc = plant.ready_plc()
        slowest = 0.0
        for number in range(1000):
            connect(plant).close()
            asked = time.monotonic()
            assert plc.write_integers(0, number) == 0
            assert plc.release(1) == 0
            slowest = max(slowest, time.monotonic() - asked)
        assert slowest < QUICK
        assert plc.robot_state == FRESH
        daemon.terminate()
        assert daemon.wait(5) == 0
        assert len(daemon.stderr.read()) > 0.9 * capacity, "the pipe was never full"
    finally:
        daemon.kill()
        daemon.communicate()


def test_a_full_disk_stops_the_audit_and_nothing_else(plant: Plant) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    audit = plant.directory / "audit.jsonl"
    audit.symlink_to("/dev/full")
    simulator = plant.simulator()
    mapping = plant.mapping(CELL, simulator.port)
    daemon = plant.daemon(mapping, "--control", plant.directory / "control.sock", "--audit", audit)
    plc = plant.ready_plc()
    slowest = 0.0
    for number in range(1000):
        asked = time.monotonic()
        assert plc.write_integers(0, number) == 0
        slowest = max(slowest, time.monotonic() - asked)
    daemon.wait_for_line("audit", "No space left on device")
    assert slowest < QUICK
    assert plc.robot_state == FRESH
    code, took = daemon.stop()
    print(f"full disk: slowest write {slowest * 1000:.0f} ms, stopped in {took * 1000:.0f} ms")
    assert code == 0
    assert took < 1
    assert len(daemon.lines("No space left on device")) == 1


def test_ten_cells_in_one_process(plant: Plant) -> None:
    """Each with registers of its own of one robot; memory and CPU time are printed, not judged closely."""
    simulator = plant.simulator()
    mappings = [
        plant.mapping(
            f"""\
writers: {{plc: {{modbus: {PLC}}}}}
variables:
  number:  {{robot: input_int_register_{unit}, modbus: 0, owner: plc}}
  echo:    {{robot: output_int_register_{unit}, modbus: 100}}
  doubles: {{robot: output_double_register_0..23, modbus: 200}}
""",
            simulator.port,
            name=f"cell-{unit}",
            unit=unit,
        )
        for unit in range(1, 11)
    ]
    one = plant.daemon(mappings[0])
    plant.ready_plc(unit=1)
    alone = one.resident_kilobytes()
    assert one.stop()[0] == 0
    daemon = plant.daemon(*mappings)
    plcs = {unit: plant.ready_plc(unit=unit) for unit in range(1, 11)}
    used, begin = daemon.cpu_seconds(), time.monotonic()
    rounds = 0
    while time.monotonic() - begin < 2:
        rounds += 1
        for unit, plc in plcs.items():
            assert plc.write_integers(0, 1000 * unit + rounds) == 0
        time.sleep(0.05)
    share = 100 * (daemon.cpu_seconds() - used) / (time.monotonic() - begin)
    for unit, plc in plcs.items():
        wanted = [1000 * unit + rounds]
        wait_for(lambda plc=plc, wanted=wanted: plc.integers(100) == wanted, f"the echo of cell {unit}")  # type: ignore[misc]
        assert plc.robot_state == FRESH
    memory = daemon.resident_kilobytes()
    print(
        f"ten cells at 125 Hz: {memory / 1024:.1f} MB (one: {alone / 1024:.1f} MB), {share:.0f} % of a core"
    )
    assert memory < alone + 10 * 3072
