"""Ranges, vectors and bits become variables; owners and leases become explicit."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Direction
from gatewayd.links.robot.reference import ReferenceProblem, UnresolvedReference
from gatewayd.mapping.expand import expand
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLock
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.source import parse

HEAD = """gatewayd: 1
cell: c
robot: {host: r}
modbus: {order: CDAB}
writers: {plc: {modbus: 1.1.1.1}, hmi: {modbus: 1.1.1.2}}
groups: {motion: {owner: [hmi, plc], lease: 2s}, loose: {}}
variables:
"""


def expanded(*lines: str) -> ExpandedCell:
    document, findings = read_document(parse((HEAD + "".join(f"  {line}\n" for line in lines)).encode(), "f"))
    assert findings == ()
    return expand(document)


def test_reference_to_nothing_is_kept_for_the_rules() -> None:
    """The other variables are expanded."""
    cell = expanded("a: {robot: 'robot_mode[0]'}", "b: {robot: robot_mode}")
    (found,) = cell.unresolved
    assert isinstance(found.error, UnresolvedReference)
    assert (found.part.name, found.error.name, found.error.limit) == ("a", "robot_mode", None)
    assert found.error.problem is ReferenceProblem.NOT_A_VECTOR
    assert [variable.name for variable in cell.variables] == ["b"]
    assert not cell.is_complete


def test_names_numbers_and_directions() -> None:
    """A family counts from 0; numbers follow the file; the direction follows from the name."""
    cell = expanded(
        "one: {robot: input_int_register_5}",
        "many: {robot: output_int_register_5..6}",
        "tcp: {robot: actual_TCP_pose}",
        "ratio: {robot: standard_analog_output_0}",
        "volt: {robot: standard_analog_output0}",
    )
    assert [variable.name for variable in cell.variables[:5]] == [
        "one",
        "many[0]",
        "many[1]",
        "tcp[0]",
        "tcp[1]",
    ]
    assert [variable.index for variable in cell.variables] == list(range(len(cell.variables)))
    directions = {variable.part.name: variable.direction for variable in cell.variables}
    assert directions["one"] is directions["ratio"] is Direction.INPUT
    assert directions["many"] is directions["tcp"] is directions["volt"] is Direction.OUTPUT


def lock(line: str) -> ExpandedLock:
    (found,) = expanded(line).locks
    return found


@pytest.mark.parametrize(
    "keys, owners, takeover, lease",
    [
        ("", ("plc", "hmi"), False, 5.0),
        (", owner: any", ("plc", "hmi"), False, 5.0),
        (", owner: any, lease: 1s", ("plc", "hmi"), False, 1.0),
        (", owner: plc", ("plc",), False, None),
        (", owner: plc, lease: 2s", ("plc",), False, 2.0),
        (", owner: [hmi, plc]", ("hmi", "plc"), True, 5.0),
        (", owner: [hmi, plc], takeover: false", ("hmi", "plc"), False, 5.0),
        (", owner: [hmi, plc], lease: none", ("hmi", "plc"), True, None),
        (", owner: [hmi, ghost]", ("hmi",), True, 5.0),
        (", group: motion", ("hmi", "plc"), True, 2.0),
        (", group: loose", ("plc", "hmi"), False, 5.0),
    ],
)
def test_owners_and_leases(keys: str, owners: tuple[str, ...], takeover: bool, lease: float | None) -> None:
    """One owner keeps for good, several have a lease of 5 s, a list takes over by priority."""
    found = lock(f"a: {{robot: input_int_register_0{keys}}}")
    assert (found.owners, found.takeover, found.lease) == (owners, takeover, lease)


def test_each_ungrouped_input_has_its_lock_and_each_group_one() -> None:
    """Outputs have none. Locks are counted by their first variable."""
    cell = expanded(
        "a: {robot: input_int_register_0..1, owner: plc}",
        "b: {robot: input_int_register_2, group: motion}",
        "c: {robot: output_int_register_0}",
        "d: {robot: input_int_register_3, owner: plc}",
        "e: {robot: input_int_register_4, group: motion}",
    )
    assert [(found.name, found.members) for found in cell.locks] == [
        ("a[0]", (0,)),
        ("a[1]", (1,)),
        ("motion", (2, 5)),
        ("d", (4,)),
    ]
    assert [variable.lock for variable in cell.variables] == [0, 1, 2, None, 3, 2]


def test_unknown_group_gives_no_lock() -> None:
    """The rule about it has the word."""
    cell = expanded("a: {robot: input_int_register_0, group: ghost}")
    assert (cell.variables[0].lock, cell.locks) == (None, ())


def test_expansion_stops_far_beyond_the_limit() -> None:
    """No file can fill the memory with variables."""
    cell = expanded(*(f"a{n}: {{robot: input_bit_register_0..127}}" for n in range(100)))
    assert 1024 < len(cell.variables) < 4096
