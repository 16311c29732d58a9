"""The gateway in both roles: a node for the line's master on one bus, the manager of a device on another.

Simulator, daemon, PLC, master and device are processes of their own; the device is a node of durand.
"""

from __future__ import annotations

import json
import signal
import sys
from typing import Any

import pytest

from tests.canopen.manager.sheets import DEVICE
from tests.e2e.can_plant import start_bus, start_master
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import HOST, Process, wait_for

pytestmark = pytest.mark.slow

ENCODER = 6
CELL = f"""\
canopen:
  interface: slcan
  channel: 'socket://{HOST}:{{line}}'
  bitrate: 500000
  node: 16
  autostart: true
  heartbeat: 100ms
devices:
  encoder: {{{{canopen: 'socket://{HOST}:{{own}}', interface: slcan, node: {ENCODER}, eds: encoder.eds,
    heartbeat: 900ms, watchdog: none, manager: 127, manager_heartbeat: 100ms}}}}
writers:
  plc: {{{{modbus: {PLC}}}}}
  encoder: {{{{device: encoder}}}}
variables:
  position: {{{{robot: input_int_register_0, device: {{{{at: encoder, object: 0x6004}}}}, owner: encoder,
    on_release: -1, canopen: object}}}}
  command:  {{{{robot: input_int_register_1, modbus: 0, owner: plc, lease: none}}}}
  lamp:     {{{{robot: output_int_register_1, device: {{{{at: encoder, object: 0x6200}}}}, canopen: auto, modbus: 2,
    limits: [0, 255]}}}}
"""
OPERATIONAL = 5


class Device:
    """The device as a process."""

    def __init__(self, process: Process) -> None:
        self.process = process
        said = process.answer()
        assert said == "booted", said + process.text()

    def do(self, *command: Any) -> Any:
        assert self.process.popen.stdin is not None
        self.process.popen.stdin.write(json.dumps(command) + "\n")
        return json.loads(self.process.answer())


def test_both_roles_values_both_ways_and_the_loss_of_the_device(plant: Plant) -> None:
    simulator = plant.simulator()
    _, line = start_bus(plant)
    _, own = start_bus(plant)
    (plant.directory / "encoder.eds").write_text(DEVICE)
    mapping = plant.mapping(CELL.format(line=line, own=own), simulator.port)
    module = [sys.executable, "-m", "tests.canopen.manager.foreign_node", "durand", "slcan"]
    device = Device(plant.program([*module, f"socket://{HOST}:{own}", str(ENCODER)], "device"))
    master = start_master(plant, mapping, "slcan", f"socket://{HOST}:{line}")
    daemon = plant.daemon(mapping, "--state", plant.directory)
    plc = plant.ready_plc()

    # The device was booted, and what it says is in the robot, and on the line.
    wait_for(lambda: device.do("state") == "OPERATIONAL", "the device to be started")
    device.do("set", 0x6004, 0, 4711)
    wait_for(lambda: simulator.integer("input_int_register_0") == 4711, "device -> robot")
    assert master.ask("read", 0x2010, 1) == 4711
    assert device.do("get", 0x1017, 0) == 300

    # What the PLC tells the robot comes back from it, and goes to the device.
    master.becomes(OPERATIONAL)
    assert plc.write(0, [0, 42]) == 0
    wait_for(lambda: device.do("get", 0x6200, 0) == 42, "robot -> device")
    assert plc.read(2, 2) == [0, 42]

    # EMCY is in the log, in words.
    device.do("emcy", 0x4210, 9, "01")
    daemon.wait_for_line("device reports", "4210h device temperature too high")

    # The device stands still: its fallback goes to the robot, and the PLC's value stays.
    device.process.signal(signal.SIGSTOP)
    wait_for(lambda: simulator.integer("input_int_register_0") == -1, "the fallback")
    assert simulator.integer("input_int_register_1") == 42
    daemon.wait_for_line("device lost", "heartbeat lost")
    device.process.signal(signal.SIGCONT)
    wait_for(lambda: simulator.integer("input_int_register_0") == 4711, "the device to come back")
