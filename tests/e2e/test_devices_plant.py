"""Everybody in one plant: robot, PLC, an I/O island and a CANopen device, each a process or a connection of its own."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.can_plant import start_bus
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, free_port, wait_for
from tests.e2e.test_devices import GOOD, LOST, STATE, Island

NODE = 5
WORDS = 16
"""Of each device in the status block."""
LOSSES = 15
"""The word that counts them."""
OWN, POSITION = 2, 6
"""Variables as the status block numbers them."""
HEAD = """\
devices:
  island: {{modbus: '{host}:{island}', poll: 10ms, timeout: 200ms, watchdog: none}}
{device}writers:
  island: {{device: island}}
  plc: {{modbus: {plc}}}
{writer}variables:
  level:    {{robot: input_int_register_1, device: {{at: island, input: 4, type: uint16}}, owner: island}}
  own:      {{robot: input_int_register_3, modbus: 20, owner: plc}}
  order:    {{robot: input_int_register_5, modbus: 50, owner: plc}}
  level_of: {{robot: output_int_register_1, modbus: 60}}
  again:    {{robot: input_int_register_7, device: {{at: island, input: 5, type: uint16}}, owner: island}}
  order_of: {{robot: output_int_register_5, device: {{at: island, holding: 10, type: uint16}}, limits: [0, 65535]}}
  sixth_of: {{robot: output_int_register_6, device: {{at: island, holding: 12, type: uint16}}, limits: [0, 65535],
    modbus: 70}}
{variables}"""
DEVICE = """\
  encoder: {{canopen: 'socket://{host}:{bus}', interface: slcan, node: {node}, heartbeat: 600ms, watchdog: none}}
"""
WRITER = "  encoder: {device: encoder}\n"
VARIABLES = """\
  position: {robot: input_int_register_6, device: {at: encoder, object: 0x6004, type: uint32, pdo: 1}, owner: encoder,
    on_release: 77}
  again_of: {robot: output_int_register_7, device: {at: encoder, object: 0x6200, type: uint8, pdo: none},
    limits: [0, 255]}
"""


class Encoder(Process):
    """python-canopen's LocalNode as a program."""

    def __init__(self, log: Path, bus: int) -> None:
        words = ["canopen", "slcan", f"socket://{HOST}:{bus}", str(NODE)]
        super().__init__([sys.executable, "-m", "tests.canopen.manager.foreign_node", *words], log)
        assert self.answer() == "booted", self.text()

    def do(self, *command: Any) -> Any:
        assert self.popen.stdin is not None
        self.popen.stdin.write(json.dumps(command) + "\n")
        return json.loads(self.answer())


class Line:
    """The plant, begun without the encoder in the mapping."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        _, self.bus = start_bus(plant)
        port = free_port()
        self.ports = {"host": HOST, "island": port, "bus": self.bus, "node": NODE, "plc": PLC}
        self.island = plant.add(Island(plant.directory / "island.log", port))
        self.encoder = plant.add(Encoder(plant.directory / "encoder.log", self.bus))
        self.simulator: Simulator = plant.simulator()
        self.socket = plant.directory / "control.sock"
        self.daemon: Daemon = plant.daemon("--control", self.socket, self.write(has_encoder=False))
        self.plc: Plc = plant.ready_plc()

    def write(self, *, has_encoder: bool) -> Path:
        """The mapping file."""
        more = (DEVICE.format(**self.ports), WRITER, VARIABLES) if has_encoder else ("", "", "")
        text = HEAD.format(**self.ports, device=more[0], writer=more[1], variables=more[2])
        return self.plant.mapping(text, self.simulator.port)

    def robot_has(self, register: int, value: int) -> float:
        field = f"input_int_register_{register}"
        return wait_for(lambda: self.simulator.integer(field) == value, f"{value} in the robot's {field}")

    def states(self) -> list[int]:
        """Of island and encoder, as the PLC reads them."""
        return [self.plc.read(STATE)[0], self.plc.read(STATE + WORDS)[0]]


@pytest.fixture
def line(plant: Plant) -> Line:
    return Line(plant)


@pytest.mark.slow
def test_a_canopen_device_joins_a_running_plant_and_leaves_it(line: Line) -> None:
    plc, island = line.plc, line.island
    island.do("set input 4 1234")
    assert plc.write_integers(20, 9) == 0
    line.robot_has(1, 1234)
    line.robot_has(3, 9)
    losses = plc.read(STATE + LOSSES)

    # It joins by a reload: the gateway opens the bus, boots the node, and has its values; nobody else notices.
    line.encoder.do("set", 0x6004, 0, 4321)
    line.write(has_encoder=True)
    line.daemon.signal(signal.SIGHUP)
    wait_for(lambda: line.states() == [GOOD, GOOD], "both devices to be good")
    assert line.encoder.do("state") == "OPERATIONAL"
    line.encoder.do("set", 0x6004, 0, 4322)
    line.robot_has(6, 4322)

    # The encoder's value is seen by PLC and island, the PLC's by the island, the island's by PLC and encoder.
    wait_for(lambda: plc.integers(70) == [4322], "the encoder's value in the PLC")
    wait_for(lambda: island.do("get holding 12") == 4322, "the encoder's value in the island")
    assert plc.write_integers(50, 55) == 0
    wait_for(lambda: island.do("get holding 10") == 55, "the PLC's value in the island")
    island.do("set input 5 66")
    wait_for(lambda: line.encoder.do("get", 0x6200, 0) == 66, "the island's value in the encoder")
    assert plc.integers(60) == [1234]

    # Lost: its fallback in the robot in bounded time; the island and the PLC keep what they have.
    line.encoder.kill()
    took = line.robot_has(6, 77)
    print(f"encoder killed -> fallback in the robot: {took * 1000:.0f} ms")
    assert took < 2.0
    wait_for(lambda: line.states() == [GOOD, LOST], "the status block to say so")
    assert plc.owner(POSITION) == 0
    assert (line.simulator.integer("input_int_register_3"), plc.owner(OWN)) == (9, 2)

    # It leaves by a reload, which the island and the PLC do not notice either.
    line.write(has_encoder=False)
    line.daemon.signal(signal.SIGHUP)
    line.daemon.wait_for_line("reloaded: cell", count=2)
    wait_for(lambda: plc.writable, "the robot's new session")
    assert line.simulator.integer("input_int_register_1") == 1234
    assert plc.read(STATE + LOSSES) == losses
    assert plc.read(STATE) == [GOOD]
    assert (line.simulator.integer("input_int_register_3"), plc.owner(OWN)) == (9, 2)
