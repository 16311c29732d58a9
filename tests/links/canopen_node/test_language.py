"""What the CANopen node's kind says of a mapping."""

from __future__ import annotations

import pytest

from gatewayd.links.canopen_node.eds import objects_of
from gatewayd.links.canopen_node.language import LANGUAGE
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.mapping.loader import load

CELL = load(
    b"""\
gatewayd: 1
cell: c
robot: {host: r}
canopen: {channel: can0, bitrate: 500000, node: 16, pdos: {p: {variables: [a, b]}}}
writers:
  line: {canopen: any, node: 1, heartbeat: 1s}
  plc: {modbus: 192.0.2.1}
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


SCALED = """\
gatewayd: 1
cell: press-3
robot: {host: 127.0.0.9}
canopen: {channel: c, bitrate: 500000, node: 16}
writers: {line: {canopen: any, node: 1, heartbeat: 1s}}
variables:
  speed:
    {robot: input_double_register_0, canopen: {type: INTEGER16, scale: 0.1, offset: 5}, limits: [5, 5.3], owner: line}
  force: {robot: output_double_register_0, canopen: {type: INTEGER16, scale: 0.01}}
"""


def test_a_scaled_variable_is_an_integer_on_the_bus_and_a_real_in_the_cell() -> None:
    loaded = load(SCALED.encode(), "a.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    node = loaded.plan.the(CanopenPlan)
    assert [placed.type_text for placed in node.objects] == ["INTEGER16 * 0.1 + 5", "INTEGER16 * 0.01"]
    entry = objects_of(node, loaded.plan.cell).entry(node.objects[0].index, 1)
    assert (entry.low, entry.high) == (0, 3), "the limits, as raw numbers"


@pytest.mark.parametrize(
    "old, new, rule",
    [
        ("scale: 0.01", "scale: 0", "GW438"),
        ("type: INTEGER16, scale: 0.01", "type: INTEGER16", "GW413"),
        ("type: INTEGER16, scale: 0.01", "type: BOOLEAN, scale: 0.01", "GW413"),
        ("robot: output_double_register_0, canopen: {type: INTEGER16, scale: 0.01}",
         "robot: output_bit_register_0, canopen: {scale: 2}", "GW438"),
    ],
)  # fmt: skip
def test_what_cannot_be_scaled_is_refused(old: str, new: str, rule: str) -> None:
    loaded = load(SCALED.replace(old, new).encode(), "a.yaml")
    assert loaded.plan is None
    assert [finding.rule.id for finding in loaded.diagnostics if finding.rule.severity.name == "ERROR"] == [
        rule
    ]


@pytest.mark.parametrize(
    "robot, place, found",
    [
        ("actual_q", "type: UNSIGNED16, scale: 0.001", True),
        ("actual_q", "type: INTEGER16, scale: 0.001", False),
        ("actual_q", "type: INTEGER16, scale: 0.0001", True),
        ("actual_TCP_pose", "type: INTEGER16, scale: 0.00005", True),
        ("actual_TCP_pose", "type: INTEGER16, scale: 0.0001", False),
        ("speed_scaling", "type: UNSIGNED8, scale: 1", True),
        ("speed_scaling", "type: UNSIGNED8, scale: 0.01", False),
        ("speed_scaling", "type: REAL32", False),
        ("output_double_register_0", "type: INTEGER16, scale: 0.1", False),
    ],
)
def test_reals_that_an_object_can_never_show(robot: str, place: str, found: bool) -> None:
    """Sign, range and resolution, element by element; once for each line."""
    text = (
        "gatewayd: 1\ncell: c\nrobot: {host: 127.0.0.10}\ncanopen: {channel: can0, bitrate: 500000, node: 16}\n"
        f"variables:\n  a: {{robot: {robot}, canopen: {{{place}}}}}\n"
    )
    rules = [finding.rule.id for finding in load(text.encode(), "a.yaml").diagnostics]
    assert rules.count("GW415") == found
