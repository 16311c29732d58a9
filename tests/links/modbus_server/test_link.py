"""The Modbus side of one cell, as the daemon sees it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Level
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

TEXT = b"""\
gatewayd: 1
cell: press
robot: {host: robot}
modbus: {listen: '127.0.0.1:1502', unit: 3}
variables: {ready: {robot: output_bit_register_0, modbus: 0.0}}
"""


def compiled() -> Plan:
    plan = load(TEXT, "cell.yaml").plan
    assert plan is not None
    return plan


def test_without_a_listener_nobody_reaches_it_and_it_says_so() -> None:
    plan = compiled()
    unit = ModbusUnit(plan.the(ModbusPlan), Cell(plan.cell))
    health = unit.health()
    assert not unit.reachable
    assert (health.level, health.words) == (Level.BAD, "not listening, see the log")
    assert health.figures == {
        "listen": "127.0.0.1:1502",
        "unit": 3,
        "connections": 0,
        "refused": {},
        "ignored": 0,
        "listening": False,
        "tls": None,
        "tls_listen": "",
    }


async def test_with_a_listener_that_listens_it_is_reachable() -> None:
    plan = compiled()
    unit = ModbusUnit(plan.the(ModbusPlan), Cell(plan.cell))
    listener = ModbusListener("127.0.0.1", 1502)
    listener._port = 0
    await listener.start()
    listener._port = 1502
    unit.listeners.append(listener)
    try:
        assert unit.reachable
        assert (unit.health().level, unit.health().words) == (Level.GOOD, "listening, no connections")
        assert unit.health().figures["refused"] == {"denied": 0, "full": 0, "crowded": 0}
        listener.serve([(unit.plan, unit.cell)])
        listener._units[3].ignored = 7
        assert unit.health().figures["ignored"] == 7
    finally:
        await listener.close()


def test_it_is_the_unit_of_another_plan_and_cell_after_a_reload() -> None:
    plan = compiled()
    unit = ModbusUnit(plan.the(ModbusPlan), Cell(plan.cell))
    other, successor = replace(plan.the(ModbusPlan), unit=9), Cell(plan.cell)
    unit.rebind(other, successor, 1.0)
    assert (unit.plan, unit.cell) == (other, successor)
    assert unit.health().figures["unit"] == 9


def test_nothing_of_tls_is_loaded_where_no_listener_has_it() -> None:
    """A daemon with plain Modbus pays nothing for it."""
    program = (
        "import sys; import gatewayd.links.modbus_server.runtime\n"
        "print([name for name in sys.modules if name.rpartition('.')[2] in "
        "('secure_connection', 'trust', 'trust_findings', 'renewal', 'x509', 'der')])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
