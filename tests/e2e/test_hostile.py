"""Bytes that nobody should send: the process lives, the others are served, memory does not grow.

GATEWAYD_FUZZ_CASES scales it: cases for Modbus, and as many or more for RTDE.
"""

from __future__ import annotations

import os
import time

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import HMI, LINE, PLC, STRANGER
from tests.e2e.processes import HOST, Process, wait_for

CASES = int(os.environ.get("GATEWAYD_FUZZ_CASES", "5000"))
GROWTH = 4096
"""Kilobytes by which a process may grow from the first third of the cases to the last."""

CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
  hmi: {{modbus: {HMI}}}
  line: {{modbus: {LINE}}}
variables:
  guarded: {{robot: input_int_register_0,       modbus: 0,   owner: plc}}
  open:    {{robot: input_double_register_0..5, modbus: 2,   owner: any, lease: 100ms}}
  bits:    {{robot: input_bit_register_0..31,   modbus: [40.0, {{coil: 0}}], owner: any, lease: 100ms}}
  echo:    {{robot: output_int_register_0,      modbus: 100}}
  pose:    {{robot: actual_TCP_pose,            modbus: {{input: 0}}, on_stale: exception}}
"""


@pytest.mark.timeout(120 + CASES // 100)
def test_fuzzed_modbus(plant: Plant) -> None:
    """One attacker may write, one may not; the PLC beside them never notices."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port, modbus_options=", connections: 8"))
    plc = plant.ready_plc()
    slowest = 0.0
    sizes: list[int] = []

    def served(number: int) -> None:
        nonlocal slowest
        start = time.monotonic()
        assert plc.write_integers(0, number) == 0
        assert plc.integers(0) == [number]
        slowest = max(slowest, time.monotonic() - start)

    for third in range(3):
        attackers = [
            plant.start("modbus_fuzzer", HOST, plant.modbus, source, CASES // 6 + 1, 2 * third + seed)
            for seed, source in enumerate((HMI, STRANGER))
        ]
        number = 1000 * third
        while any(attacker.running for attacker in attackers):
            number += 1
            served(number)
        for attacker in attackers:
            words = attacker.answer().split()
            assert words[1:2] == ["cases"], attacker.text()
            print(*words)
        sizes.append(daemon.resident_kilobytes())
    wait_for(
        lambda: simulator.integer("input_int_register_0") == plc.integers(0)[0], "the last value in the robot"
    )
    wait_for(lambda: plc.integers(100) == plc.integers(0), "its echo")
    wait_for(lambda: plc.status(26) == 1, "the attackers' connections to be gone")
    assert daemon.running
    assert "internal error" not in daemon.text()
    assert "Traceback" not in daemon.text()
    print(f"RSS {sizes} kB, slowest write and read beside it {slowest * 1000:.1f} ms")
    assert sizes[-1] - sizes[0] < GROWTH


ROBOT = """\
writers: {plc: {modbus: 127.0.0.2}}
variables:
  told:    {robot: output_double_register_0, modbus: 0}
  number:  {robot: input_int_register_0,     modbus: 10}
"""


def cases_of(madmen: Process) -> tuple[int, int]:
    """Cases and connections so far."""
    assert madmen.popen.stdin is not None
    madmen.popen.stdin.write("\n")
    cases, connections = map(int, madmen.answer().split())
    return cases, connections


def test_hostile_controllers_beside_a_good_one(plant: Plant) -> None:
    """Six robots of one daemon send rubbish; the seventh is served as if it were alone."""
    madmen = plant.start("hostile_controller", HOST, 6, 1)
    ports = [int(port) for port in madmen.answer().split()]
    good = plant.simulator()
    cells = [
        plant.mapping(ROBOT, port, name=f"bad-{number}", unit=number + 2) for number, port in enumerate(ports)
    ]
    daemon = plant.daemon(*cells, plant.mapping(CELL, good.port, name="good", unit=1))
    plc = plant.ready_plc()
    packages = plc.status(15)
    number = 0
    sizes = [daemon.resident_kilobytes()]
    start = time.monotonic()

    def enough() -> bool:
        nonlocal number
        number += 1
        assert plc.write_integers(0, number) == 0
        assert plc.integers(0) == [number]
        return time.monotonic() - start > 3

    wait_for(enough, "three seconds of rubbish")
    sizes.append(daemon.resident_kilobytes())
    cases, connections = cases_of(madmen)
    arrived = (plc.status(15) - packages) % 65536
    print(f"{cases} cases in {connections} connections; {arrived} good packages meanwhile; RSS {sizes} kB")
    assert connections > 24
    assert arrived > 100
    wait_for(lambda: good.integer("input_int_register_0") == number, "the last value in the good robot")
    assert len(daemon.lines("robot lost", "cell=good")) == 0
    assert "internal error" not in daemon.text()
    assert "Traceback" not in daemon.text()
    assert sizes[-1] - sizes[0] < GROWTH


@pytest.mark.timeout(120 + CASES // 20)
def test_fuzzed_rtde_in_many_connections(plant: Plant) -> None:
    """A connection for every case, with no pause in between: the link goes on, and takes no memory for good."""
    madman = plant.start("hostile_controller", HOST, 1, 2)
    mapping = plant.mapping(ROBOT, int(madman.answer()))
    connections = max(300, CASES // 20)
    link = plant.start("fast_link", str(mapping), connections)
    answer = link.answer()
    assert answer, link.text()
    sessions, *sizes = map(int, answer.split())
    cases, accepted = cases_of(madman)
    print(f"{cases} cases in {accepted} connections, {sessions} sessions; RSS {sizes} kB")
    assert accepted >= connections
    assert sessions > connections // 10
    assert "Traceback" not in link.text()
    assert sizes[-1] - sizes[0] < GROWTH
