"""Cells for tests of PLC programs: from a few lines of a mapping, and one with every type, order and scale."""

from __future__ import annotations

from ipaddress import ip_network
from itertools import product

from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import ORDERS, TYPES, make_codec
from gatewayd.plc.tags import PlcWishes

HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 127.0.0.9, series: e}
modbus: {listen: 127.0.0.1:1502%s}
writers: {plc: {modbus: 127.0.0.1, timeout: 1s}, hmi: {modbus: 127.0.0.2, timeout: 1s}}
variables:
"""
SCALES = ((1.0, 0.0), (0.1, 0.0), (-0.25, 3.0), (7.0, -100.0))
"""Scale and offset."""


def plan_of(*lines: str, settings: str = "") -> Plan:
    """The plan of a mapping with these variables."""
    text = HEAD % settings + "".join(f"  {line}\n" for line in lines)
    loaded = load(text.encode(), "folder/press-3.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def model(*lines: str, settings: str = "", wishes: PlcWishes | None = None) -> PlcModel:
    """What the PLC needs of it."""
    return model_of(plan_of(*lines, settings=settings), wishes or PlcWishes(writer="plc"))


def complete_plan() -> Plan:
    """Every type in every order with every scale, in both directions, as integers and reals of the robot; and bits."""
    variables: list[Variable] = []
    locks: list[Lock] = []
    placements: list[Placement] = []
    for direction in Direction:
        address = 0 if direction is Direction.INPUT else 4000
        for name, order, (scale, offset), kind in product(
            TYPES, ORDERS, SCALES, (ValueKind.INT, ValueKind.FLOAT)
        ):
            if name == "bool" and (scale, offset) != (1, 0):
                continue
            number = len(variables) + 1
            low, high = (-(1 << 31), (1 << 31) - 1) if kind is ValueKind.INT else (None, None)
            lock = len(locks) if direction is Direction.INPUT else None
            variables.append(
                Variable(number, f"v{number}", direction, kind, "field", low=low, high=high, lock=lock)
            )
            if lock is not None:
                locks.append(Lock(f"v{number}", (number - 1,), (0,)))
            codec = make_codec(name, order, kind=kind, scale=scale, offset=offset, low=low, high=high)
            bit = (0, 8)[kind is ValueKind.INT] if TYPES[name].is_byte else None
            placements.append(Placement(number - 1, Area.HOLDING, address, bit, codec))
            # Two bytes share a register: the kinds vary fastest.
            address += 0 if bit == 8 else codec.words
        for bit in range(16):
            number = len(variables) + 1
            lock = len(locks) if direction is Direction.INPUT else None
            variables.append(
                Variable(number, f"v{number}", direction, ValueKind.BOOL, "field", bit=bit, lock=lock)
            )
            if lock is not None:
                locks.append(Lock(f"v{number}", (number - 1,), (0,)))
            placements.append(Placement(number - 1, Area.HOLDING, address, bit, None))
    cell = CellDefinition("complete", 0x12345678, tuple(variables), tuple(locks), (Writer("plc"),), 0.1)
    plan = ModbusPlan(
        "127.0.0.1",
        1502,
        1,
        (),
        8,
        None,
        fill_gaps=False,
        placements=tuple(placements),
        writers=((ip_network("127.0.0.1"), 0),),
    )
    return Plan("complete.yaml", cell, {"modbus": plan})


def greatest_plan() -> Plan:
    """As many variables as a cell may have: scaled reals from the robot."""
    count = range(1024)
    variables = tuple(Variable(n + 1, f"v{n}", Direction.OUTPUT, ValueKind.FLOAT, "field") for n in count)
    codec = make_codec("float32", "ABCD", kind=ValueKind.FLOAT, scale=0.1, offset=0.0)
    places = tuple(Placement(n, Area.HOLDING, 2 * n, None, codec) for n in count)
    cell = CellDefinition("greatest", 0x12345678, variables, (), (Writer("plc"),), 0.1)
    modbus = ModbusPlan("127.0.0.1", 1502, 1, (), 8, None, fill_gaps=False, placements=places, writers=())
    return Plan("greatest.yaml", cell, {"modbus": modbus})
