"""A CANopen node in words."""

from __future__ import annotations

from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.registry import kind_of
from gatewayd.mapping.loader import load

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
canopen: {channel: can0, bitrate: 500000, node: 16, pdos: {command: {variables: [order]}}}
writers: {line: {canopen: rpdo, node: 1, heartbeat: 500ms}}
variables:
  order: {robot: input_int_register_2, canopen: {type: UNSIGNED16}, owner: line}
  count: {robot: output_int_register_2, canopen: object}
"""


def test_objects_pdos_and_address() -> None:
    plan = load(TEXT.encode(), "cell.yaml").plan
    assert plan is not None
    found = kind_of("canopen").describe(plan.the(CanopenPlan), plan.cell)
    assert found.address == "socketcan:can0"
    assert found.fields == {"channel": "socketcan:can0", "node": 16}
    assert found.settings["consumers"] == "node=1 timeout=500 writer=line"
    assert (
        found.settings["RPDO 1"]
        == "command, COB-ID 0x210 by the node-ID, transmission 254: order 2070h:01/16"
    )
    assert "pdos" not in found.settings
    (order,), (count,) = found.places[0], found.places[1]
    assert order.fields["cob_id"] == 0x210
    assert order.notation == "COB-ID 0x210"
    assert (count.fields["cob_id"], count.notation) == (None, "by SDO")
