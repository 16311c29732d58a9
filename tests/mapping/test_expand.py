"""Ranges, vectors and bits become variables; owners and leases become explicit."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.mapping.document import read_document
from gatewayd.mapping.expand import (
    ConcreteLock,
    ConcretePlacement,
    ExpandedCell,
    PlacementProblem,
    ReferenceProblem,
    expand,
)
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


def placed(line: str) -> tuple[ConcretePlacement, ...]:
    return expanded(line).placements


def test_reference_to_nothing_is_kept_for_the_rules() -> None:
    """The other variables are expanded."""
    cell = expanded("a: {robot: 'robot_mode[0]'}", "b: {robot: robot_mode}")
    assert [(found.part.name, found.problem, found.name, found.limit) for found in cell.unresolved] == [
        ("a", ReferenceProblem.NOT_A_VECTOR, "robot_mode", None)
    ]
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


def test_kinds_and_ranges_follow_the_robots_type() -> None:
    cell = expanded(
        "a: {robot: output_int_register_0}",
        "b: {robot: output_double_register_0}",
        "c: {robot: output_bit_register_0}",
        "d: {robot: actual_digital_input_bits}",
    )
    assert [(variable.kind, variable.low, variable.high) for variable in cell.variables] == [
        (ValueKind.INT, -(1 << 31), (1 << 31) - 1),
        (ValueKind.FLOAT, None, None),
        (ValueKind.BOOL, None, None),
        (ValueKind.INT, 0, (1 << 64) - 1),
    ]


@pytest.mark.parametrize(
    "reference, type_name, words",
    [
        ("output_bit_register_0", "bool", 1),
        ("output_bit_register_64", "bool", 1),
        ("output_int_register_0", "int32", 2),
        ("runtime_state", "uint32", 2),
        ("actual_digital_input_bits", "uint64", 4),
        ("output_double_register_0", "float64", 4),
        ("standard_digital_output", "uint16", 1),
        ("'joint_mode[0]'", "int32", 2),
    ],
)
def test_default_types(reference: str, type_name: str, words: int) -> None:
    """Without `type` a register takes the robot's type whole."""
    (placement,) = placed(f"a: {{robot: {reference}, modbus: 10}}")
    assert (placement.type, placement.words, placement.order) == (type_name, words, "CDAB")


def test_families_lie_at_consecutive_addresses() -> None:
    """Numbers one after the other; packed bits run over into the next register."""
    numbers = placed("a: {robot: output_double_register_0..2, modbus: {holding: 200, type: float32}}")
    assert [placement.address for placement in numbers] == [200, 202, 204]
    bits = placed("a: {robot: output_bit_register_0..2, modbus: [500.14, {discrete: 8}]}")
    assert [placement.place for placement in bits] == ["500.14", "8", "500.15", "9", "501.0", "10"]
    assert [placement.notation for placement in bits[:2]] == ["400501.14", "100009"]
    assert bits[0].type == "bit"


@pytest.mark.parametrize(
    "reference, placement, problem",
    [
        ("output_int_register_0", "0.3", PlacementProblem.NUMBER_IN_BIT),
        ("output_int_register_0", "{discrete: 3}", PlacementProblem.NUMBER_IN_BIT),
        ("output_bit_register_0", "{holding: 3, type: bit}", PlacementProblem.BIT_WITHOUT_PLACE),
        ("output_bit_register_0", "{holding: 3.1, type: int16}", PlacementProblem.TYPE_IN_BIT),
        ("output_bit_register_0", "{coil: 3, scale: 2}", PlacementProblem.SCALED_BIT),
        ("output_int_register_0", "{holding: 3, scale: 0}", PlacementProblem.SCALE_OF_ZERO),
        ("output_int_register_0", "65535", PlacementProblem.BEYOND_END),
        ("output_int_register_0", "65534", None),
        ("output_bit_register_0", "{holding: 3.1, type: bool}", None),
    ],
)
def test_impossible_placements(reference: str, placement: str, problem: PlacementProblem | None) -> None:
    """They are marked for the rules, which say what is wrong."""
    (found,) = placed(f"a: {{robot: {reference}, modbus: {placement}}}")
    assert found.problem is problem


def test_placement_knows_its_place_in_the_file() -> None:
    """Of a list every placement points at its own address."""
    first, second = placed("a: {robot: output_bit_register_0, modbus: [0.0, {discrete: 0}]}")
    assert [first.position.column, second.position.column] == [46, 62]


def lock(line: str) -> ConcreteLock:
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
