"""Cells with devices, of which the robot is a list of values."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.links.devices.modbus.plan import ModbusDevicePlan
from gatewayd.mapping.loader import Loaded, load
from gatewayd.mapping.plan import Plan

NOW = 1000.0
HEAD = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
modbus: {listen: '127.0.0.1:1502', allow: 127.0.0.1}
devices:
  island: {modbus: '127.0.0.1:1503', poll: 20ms, watchdog: none}
  gripper: {serial: /dev/ttyUSB0, baudrate: 115200, unit: 9, watchdog: 1s}
writers:
  island: {device: island}
  plc: {modbus: 127.0.0.1, timeout: 1s}
variables:
"""
VARIABLES = """\
  present: {robot: input_bit_register_0, device: {at: island, discrete: 3}, owner: island}
  level: {robot: input_double_register_1, device: {at: island, input: 4, type: int16, scale: 0.1},
    owner: island, limits: [0, 100]}
  speed: {robot: input_int_register_2, device: {at: island, holding: 7, type: uint16}, owner: [plc, island],
    takeover: true, lease: 5s, modbus: 0}
  clamp: {robot: output_bit_register_4, device: {at: island, coil: 0}}
  force: {robot: output_int_register_7, device: {at: gripper, holding: 1002, bits: 0..7, rest: keep,
    on_connect: write, every: 1s}, limits: [0, 255]}
"""


def loaded(variables: str = VARIABLES, head: str = HEAD) -> Loaded:
    """A mapping file, read and judged."""
    return load((head + variables).encode(), "press.yaml")


def planned(variables: str = VARIABLES, head: str = HEAD) -> Plan:
    """The plan of a mapping without errors."""
    found = loaded(variables, head)
    assert [each.message for each in found.errors] == []
    assert found.plan is not None
    return found.plan


def device(plan: Plan, name: str) -> ModbusDevicePlan:
    """One of its devices."""
    return plan.of(ModbusDevicePlan)[name]


class FakeRobot:
    """A cell whose robot is fresh, or not."""

    def __init__(self, plan: Plan) -> None:
        self.cell = Cell(plan.cell)
        self.index = {variable.name: index for index, variable in enumerate(plan.cell.variables)}

    def fresh(self, now: float = NOW, **outputs: Value) -> None:
        """The robot is there, takes what is written, and reports these outputs."""
        cell = self.cell
        if not cell.accepts_writes:
            cell.robot_connected(now)
            cell.adopt(dict.fromkeys(cell.image.inputs, 0), now)
        cell.package_arrived(now, now)
        for name, value in outputs.items():
            cell.image.values[self.index[name]] = value
        cell.outputs_written(now)

    def value(self, name: str) -> Value:
        """What the cell has."""
        return self.cell.image.values[self.index[name]]

    def owner(self, name: str) -> str:
        """Who owns it; empty: nobody."""
        lock = self.cell.definition.variables[self.index[name]].lock
        assert lock is not None
        owner = self.cell.ownership.owners[lock]
        return "" if owner is None else self.cell.definition.writers[owner].name
