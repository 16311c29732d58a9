"""What the daemon gets of the kind."""

from __future__ import annotations

from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.runtime import RUNTIME
from gatewayd.mapping.loader import load


def test_units_are_made_and_their_listeners_are_shared(tmp_path: Path) -> None:
    plan = load(
        b"gatewayd: 1\ncell: press\nrobot: {host: robot}\nmodbus: {}\n"
        b"variables: {ready: {robot: output_bit_register_0, modbus: 0.0}}\n",
        "cell.yaml",
    ).plan
    assert plan is not None
    shared = RUNTIME.share()
    cell = Cell(plan.cell)
    unit = RUNTIME.make(plan.the(ModbusPlan), cell, Context(0.0, tmp_path, shared))
    assert isinstance(shared, Listeners)
    assert isinstance(unit, ModbusUnit)
    assert unit.cell is cell
