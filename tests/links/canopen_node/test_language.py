"""What the CANopen node's kind says of a mapping."""

from __future__ import annotations

from gatewayd.links.canopen_node.language import LANGUAGE
from gatewayd.mapping.loader import load

CELL = load(
    b"""\
gatewayd: 1
cell: c
robot: {host: r}
canopen: {channel: can0, bitrate: 500000, node: 16, pdos: {p: {variables: [a, b]}}}
writers:
  line: {canopen: any, node: 1, heartbeat: 1s}
  plc: {modbus: 10.0.0.1}
variables:
  a: {robot: input_int_register_0}
  b: {robot: input_bit_register_0}
  c: {robot: input_int_register_1, canopen: object}
  d: {robot: input_int_register_2}
""",
    "f",
).cell
LINE, PLC = (part.spec for part in CELL.document.writers.values())


def test_writers_have_services_and_a_heartbeat() -> None:
    assert LANGUAGE.names(LINE) == ("RPDO and SDO, heartbeat of node 1",)
    assert (LANGUAGE.names(PLC), LANGUAGE.knows(PLC), LANGUAGE.silence(PLC)) == ((), False, None)
    assert (LANGUAGE.silence(LINE), LANGUAGE.ways_of_writer(LINE)) == (
        1.0,
        frozenset({"RPDO", "SDO"}),
    )


def test_variables_are_in_pdos_or_objects() -> None:
    ways = [LANGUAGE.ways_of_variable(variable, CELL) for variable in CELL.variables]
    assert ways == [{"RPDO", "SDO"}, {"RPDO", "SDO"}, {"SDO"}, set()]
    places = [LANGUAGE.places_of(part, CELL.document) for part in CELL.document.variables.values()]
    assert places == [True, True, True, False]


def test_one_pdo_writes_what_it_carries() -> None:
    assert LANGUAGE.writes_whole(LINE, CELL.variables[:2], CELL)
    assert not LANGUAGE.writes_whole(LINE, CELL.variables[:3], CELL)
    assert not LANGUAGE.writes_whole(PLC, CELL.variables[:2], CELL)
