"""Where variables lie in the Modbus areas."""

from __future__ import annotations

import pytest

from gatewayd.links.modbus_places.placing import ExpandedPlacement, PlacementProblem
from gatewayd.links.modbus_server.expand import placements_of
from gatewayd.mapping.loader import load

HEAD = """gatewayd: 1
cell: c
robot: {host: r}
modbus: {order: CDAB}
variables:
"""


def placed(line: str) -> tuple[ExpandedPlacement, ...]:
    return placements_of(load(f"{HEAD}  {line}\n".encode(), "f").cell)


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
