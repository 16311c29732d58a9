"""What all places of a variable can show: what the codecs do is the measure."""

from __future__ import annotations

import math
from typing import Any

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Variable
from gatewayd.links.canopen_values import fit
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load

FLOAT32 = float.fromhex("0x1.fffffep+127")

HEAD = """\
gatewayd: 1
cell: press
robot: {host: r}
modbus: {listen: '127.0.0.1:1502'}
canopen: {channel: can0, bitrate: 500000, node: 16}
variables:
"""


def variable(line: str) -> Variable:
    loaded = load((HEAD + f"  a: {{{line}}}\n").encode(), "cell.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan.cell.variables[0]


CASES: dict[str, tuple[tuple[float, float] | None, bool]] = {
    "robot: output_int_register_0": (None, True),
    "robot: output_int_register_0, modbus: 0, canopen: auto": (None, True),
    "robot: output_int_register_0, modbus: {holding: 0, type: int64}": (None, True),
    "robot: output_int_register_0, modbus: {holding: 0, type: int16}": ((-32768, 32767), True),
    "robot: output_int_register_0, modbus: {holding: 0, type: uint32}": ((0, 0x7FFF_FFFF), True),
    "robot: output_int_register_0, modbus: {holding: 0, type: uint16}, canopen: {type: INTEGER8}": ((0, 127), True),
    "robot: output_int_register_0, modbus: [0, {holding: 4, type: uint16}]": ((0, 65535), True),
    "robot: output_int_register_0, modbus: {holding: 0, type: int16, scale: 10}": ((-327685, 327675), True),
    "robot: output_int_register_0, modbus: {holding: 0, type: float32}": (None, True),
    "robot: output_int_register_0, modbus: {holding: 0, type: bool}": (None, True),
    "robot: actual_digital_input_bits, modbus: {holding: 0, type: int64}": ((0, 2**63 - 1), True),
    "robot: output_bit_register_0, modbus: [0.0, {discrete: 1}], canopen: auto": (None, True),
    "robot: output_double_register_0, modbus: 0, canopen: auto": (None, True),
    "robot: output_double_register_0, modbus: {holding: 0, type: float32}": ((-FLOAT32, FLOAT32), True),
    "robot: output_double_register_0, canopen: {type: REAL32}": ((-FLOAT32, FLOAT32), True),
    "robot: output_double_register_0, modbus: {holding: 0, type: int16, scale: 0.5}": ((-16384.25, 16383.75), False),
    "robot: output_double_register_0, modbus: {holding: 0, type: uint16, scale: -1}": ((-65535.5, 0.5), False),
    "robot: output_double_register_0, modbus: {holding: 0, type: uint16, offset: 100}": ((99.5, 65635.5), False),
    "robot: output_double_register_0, modbus: {holding: 0, type: int16, scale: 1}, canopen: auto": (
        (-32768.5, 32767.5), False,
    ),
}  # fmt: skip


@pytest.mark.parametrize("line, expected", CASES.items())
def test_what_is_shown(line: str, expected: tuple[Any, bool]) -> None:
    """The narrowest of all places decides, on either bus; wide places restrict nothing."""
    found = variable(line)
    assert (found.shown, found.shows_nan) == expected


@pytest.mark.parametrize("scale", [1, 0.1, 0.001, -0.1, 3, 1000])
@pytest.mark.parametrize("type_name", ["int16", "uint16", "int32", "uint32"])
def test_a_register_is_off_by_less_than_a_step_exactly_within_the_bounds(
    scale: float, type_name: str
) -> None:
    line = f"robot: output_double_register_0, modbus: {{holding: 0, type: {type_name}, scale: {scale}}}"
    loaded = load((HEAD + f"  a: {{{line}}}\n").encode(), "cell.yaml")
    assert loaded.plan is not None
    assert loaded.plan.of(ModbusPlan)
    (placement,) = loaded.plan.the(ModbusPlan).placements
    (one,) = loaded.plan.cell.variables
    assert one.shown is not None
    assert placement.codec is not None
    step = abs(scale)
    for end, inwards in ((one.shown[0], 1), (one.shown[1], -1)):
        for distance, shown in ((0.2, True), (0.5, True), (-0.2, False), (-1e6, False)):
            value = end + inwards * distance * step
            seen = placement.codec.decode(placement.codec.encode(value))
            assert seen is not None
            assert (abs(seen - value) <= 0.5001 * step) is shown, (value, seen)


@pytest.mark.parametrize("can_type", ["INTEGER8", "UNSIGNED8", "INTEGER16", "UNSIGNED16"])
def test_an_object_shows_exactly_what_is_within_the_bounds(can_type: str) -> None:
    found = variable(f"robot: output_int_register_0, canopen: {{type: {can_type}}}")
    assert found.shown is not None
    for end, outwards in ((found.shown[0], -1), (found.shown[1], 1)):
        assert fit(end, CanType[can_type]) == end
        assert fit(end + outwards, CanType[can_type]) == end


def test_no_number_is_shown_by_reals_alone() -> None:
    """An integer shows NaN as 0, which looks like a good value."""
    for place in ("modbus: {holding: 0, type: float32}", "modbus: 0, canopen: auto"):
        assert variable(f"robot: output_double_register_0, {place}").shows_nan
    for place in ("modbus: [0, {holding: 4, type: int16, scale: 1}]", "modbus: {holding: 0, type: bool}"):
        assert not variable(f"robot: output_double_register_0, {place}").shows_nan


def test_scales_at_the_ends_of_arithmetic_have_bounds() -> None:
    """What no float holds is infinite."""
    found = variable(
        f"robot: output_double_register_0, modbus: {{holding: 0, type: float32, scale: 1{'0' * 300}}}"
    )
    assert found.shown == (-math.inf, math.inf)
