"""The gateway goes out: an island of a foreign Modbus server, a PLC, and a robot see each other's values."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, free_port, wait_for

DEVICES = """\
devices:
  island: {{modbus: '{host}:{island}', poll: 10ms, timeout: 200ms, lost_after: 400ms, watchdog: none}}
{more}writers:
  island: {{device: island}}
{writers}  plc: {{modbus: {plc}}}
variables:
  present: {{robot: input_bit_register_0,    device: {{at: island, discrete: 3}}, owner: island}}
  level:   {{robot: input_int_register_1,    device: {{at: island, input: 4, type: uint16}}, owner: island,
    on_release: 77}}
  shared:  {{robot: input_int_register_2,    device: {{at: island, holding: 7, type: uint16}}, owner: [plc, island],
    lease: 500ms, modbus: 10}}
  own:     {{robot: input_int_register_3,    modbus: 20, owner: plc}}
  say:     {{robot: input_int_register_5,    modbus: 50, owner: plc}}
  say_bit: {{robot: input_bit_register_4,    modbus: 60.0, owner: plc}}
  clamp:   {{robot: output_bit_register_4,   device: {{at: island, coil: 0}}, modbus: 30.0}}
  force:   {{robot: output_int_register_5,   device: {{at: island, holding: 11, bits: 0..7, rest: keep}}, modbus: 40,
    limits: [0, 255]}}
{variables}"""
STATE, GOOD, LOST = 64288, 2, 4
"""Where the status block has the state of the first device, and what it may be."""
LEVEL, SHARED, OWN = 2, 3, 4
THE_ISLAND = 1
THE_PLC = 2
"""Variables and writers as the status block numbers them."""


class Island(Process):
    """The island, listening when constructed."""

    def __init__(self, log: Path, port: int) -> None:
        super().__init__([sys.executable, "-m", "tests.e2e.island", HOST, str(port)], log)
        assert self.answer() == "listening", self.text()

    def do(self, command: str) -> int:
        assert self.popen.stdin is not None
        self.popen.stdin.write(command + "\n")
        return int(self.answer())


@dataclass
class Cell:
    plant: Plant
    port: int
    simulator: Simulator
    daemon: Daemon
    island: Island
    plc: Plc
    mapping: Path
    socket: Path

    def start_island(self) -> None:
        self.island = self.plant.add(Island(self.plant.directory / "island-again.log", self.port))

    def status(self) -> dict[str, object]:
        (cell,) = json.loads(self.command("status", "--json").stdout)["cells"]
        return dict(cell)

    def command(self, name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "gatewayd", name, *arguments, "--socket", str(self.socket)]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def text(port: int, more: str = "", variables: str = "", writers: str = "") -> str:
    return DEVICES.format(host=HOST, island=port, plc=PLC, more=more, variables=variables, writers=writers)


@pytest.fixture
def cell(plant: Plant) -> Cell:
    port, socket = free_port(), plant.directory / "control.sock"
    island = plant.add(Island(plant.directory / "island.log", port))
    simulator = plant.simulator()
    mapping = plant.mapping(text(port), simulator.port)
    daemon = plant.daemon("--control", socket, mapping)
    return Cell(plant, port, simulator, daemon, island, plant.ready_plc(), mapping, socket)


@pytest.mark.slow
def test_everybody_sees_the_values_of_the_others_until_the_island_is_lost(cell: Cell) -> None:
    simulator, plc = cell.simulator, cell.plc
    cell.island.do("set discrete 3 1")
    cell.island.do("set input 4 1234")
    wait_for(lambda: simulator.integer("input_int_register_1") == 1234, "the island's value in the robot")
    wait_for(lambda: plc.read(STATE) == [GOOD], "the island to be good")
    # To the island: the robot's program echoes what the PLC gives it. The other half of the register stays.
    cell.island.do("set holding 11 43775")
    assert plc.write_integers(50, 0x55) == 0
    assert plc.write(60, [1]) == 0
    wait_for(lambda: cell.island.do("get holding 11") == 0xAA55, "the robot's value in the island")
    wait_for(lambda: cell.island.do("get coil 0") == 1, "the robot's bit in the island")
    assert plc.integers(40) == [0x55]
    # The PLC takes what both may own, and gives it back by its lease.
    cell.island.do("set holding 7 300")
    wait_for(lambda: simulator.integer("input_int_register_2") == 300, "the island to own what is shared")
    assert plc.write_integers(10, 5) == 0
    wait_for(lambda: simulator.integer("input_int_register_2") == 5, "the PLC's value in the robot")
    assert plc.owner(SHARED) == THE_PLC
    wait_for(lambda: simulator.integer("input_int_register_2") == 300, "the island's turn after the lease")
    assert plc.owner(SHARED) == THE_ISLAND

    # Lost: the fallback is in the robot in bounded time, and the PLC's value is what it was.
    assert plc.write_integers(20, 9) == 0
    wait_for(lambda: simulator.integer("input_int_register_3") == 9, "the PLC's value in the robot")
    cell.island.kill()
    took = wait_for(lambda: simulator.integer("input_int_register_1") == 77, "the fallback in the robot")
    print(f"island killed -> fallback in the robot: {took * 1000:.0f} ms")
    assert took < 2.0
    wait_for(lambda: plc.read(STATE) == [LOST], "the status block to say so")
    assert (simulator.integer("input_int_register_3"), plc.owner(OWN)) == (9, THE_PLC)
    assert cell.status()["healthy"] is False
    cell.daemon.wait_for_line("device lost", "device=island")

    # Found again by itself: its values, and no output is written that did not change.
    cell.start_island()
    cell.island.do("set input 4 4321")
    wait_for(lambda: simulator.integer("input_int_register_1") == 4321, "the island's value after its return")
    assert cell.island.do("get coil 0") == 0
    wait_for(lambda: plc.write_integers(50, 0x56) == 0, "the PLC to be let write, on a busy machine")
    wait_for(lambda: cell.island.do("get holding 11") == 0x56, "the changed value in the island")


@pytest.mark.slow
def test_a_reload_that_brings_or_takes_a_device_disturbs_no_other(cell: Cell) -> None:
    simulator, plc = cell.simulator, cell.plc
    cell.island.do("set input 4 1234")
    wait_for(lambda: simulator.integer("input_int_register_1") == 1234, "the island's value in the robot")
    losses = plc.read(STATE + 15)
    more = f"  valves: {{modbus: '{HOST}:{cell.port}', unit: 2, poll: 10ms, watchdog: none}}\n"
    air = "  air: {robot: input_int_register_7, device: {at: valves, holding: 20, type: uint16}, owner: valves}\n"
    with_valves = text(cell.port, more, air, "  valves: {device: valves}\n")
    cell.island.do("set holding 20 4711")
    for count, (file, value) in enumerate(((with_valves, 4711), (text(cell.port), 0)), 1):
        cell.plant.mapping(file, simulator.port)
        cell.daemon.signal(signal.SIGHUP)
        said = cell.daemon.wait_for_line(" reload", count=count)
        if value == 0:
            # What the device owns would be released: asked for.
            assert "reload refused" in said
            done = cell.command("reload", "--force")
            assert done.returncode == 0, done.stdout + done.stderr
        wait_for(lambda: simulator.integer("input_int_register_7") == value, "the other device's value")  # noqa: B023
    assert plc.read(STATE, 16)[15] == losses[0]
    assert plc.read(STATE) == [GOOD]
    assert simulator.integer("input_int_register_1") == 1234
    assert plc.owner(LEVEL) == THE_ISLAND


@pytest.mark.slow
def test_a_gateway_that_stood_still_does_not_take_its_devices_for_lost(cell: Cell) -> None:
    cell.island.do("set input 4 1234")
    wait_for(
        lambda: cell.simulator.integer("input_int_register_1") == 1234, "the island's value in the robot"
    )
    # What the robot's silence brings the island is written in the middle of it all.
    assert cell.plc.write(60, [1]) == 0
    wait_for(lambda: cell.island.do("get coil 0") == 1, "the robot's bit in the island")
    cell.daemon.signal(signal.SIGSTOP)
    stopped = time.monotonic()
    wait_for(lambda: time.monotonic() - stopped > 1.0, "a time longer than `lost_after`")
    cell.island.do("set input 4 4321")
    cell.daemon.signal(signal.SIGCONT)
    wait_for(lambda: cell.simulator.integer("input_int_register_1") == 4321, "the island's next value")
    cell.daemon.wait_for_line("gateway stood still")
    assert cell.daemon.lines("device lost") == []
