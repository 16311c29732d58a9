"""Cells with a second gateway."""

from __future__ import annotations

from gatewayd.links.standby.plan import StandbyPlan
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

TEXT = """\
gatewayd: 1
cell: press-3
robot: {{host: 127.0.0.1}}
modbus: {{listen: '127.0.0.1:1502', allow: 127.0.0.1}}
standby: {standby}
writers:
  plc: {{modbus: 127.0.0.1, timeout: 1s}}
variables:
  part: {{robot: input_int_register_0, modbus: 10, owner: plc}}
"""


def planned(standby: str = "{peer: '192.0.2.12:2930', address: 192.0.2.50}") -> Plan:
    """The plan of a mapping without errors."""
    found = load(TEXT.format(standby=standby).encode(), "press-3.yaml")
    assert [each.message for each in found.errors] == []
    assert found.plan is not None
    return found.plan


def pair(standby: str = "{peer: '192.0.2.12:2930', address: 192.0.2.50}") -> StandbyPlan:
    """Its part about the other gateway."""
    return planned(standby).the(StandbyPlan)
