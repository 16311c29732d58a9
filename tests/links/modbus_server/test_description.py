"""A Modbus unit in words."""

from __future__ import annotations

from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.registry import kind_of
from gatewayd.mapping.loader import load

TEXT = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
modbus: {listen: '[::1]:1502', unit: 7}
writers: {plc: {modbus: ['::1', 'fe80::/64']}}
variables:
  start: {robot: input_bit_register_0, modbus: [{holding: 2.3}, {coil: 7}], owner: plc}
  speed: {robot: input_double_register_1, modbus: {holding: 24, type: int16, scale: 0.1, order: BADC}, limits: [0, 1]}
"""


def test_places_writers_and_address() -> None:
    plan = load(TEXT.encode(), "cell.yaml").plan
    assert plan is not None
    found = kind_of("modbus").describe(plan.the(ModbusPlan), plan.cell)
    assert found.address == "[::1]:1502 unit 7"
    assert found.fields == {"listen": "[::1]:1502", "unit": 7}
    assert found.writers == {0: "::1, fe80::/64"}
    bit, coil = found.places[0]
    assert (bit.text, bit.address, bit.type) == ("holding 2.3 (400003.3)", "2.3", "bit")
    assert bit.fields == {"area": "holding", "address": 2, "bit": 3, "notation": "400003.3"}
    assert coil.fields == {"area": "coil", "address": 7, "bit": None, "notation": "000008"}
    (speed,) = found.places[1]
    assert (speed.text, speed.type) == ("holding 24 (400025) int16 BADC * 0.1", "int16 BADC")
