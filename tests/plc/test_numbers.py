"""Numbers on the wire and in the PLC: those of the registers' codec, and in what a scaled one is calculated."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import ValueKind
from gatewayd.modbus.codec import TYPES
from gatewayd.plc.numbers import NUMBERS, value_type


def test_every_type_of_the_codec_is_known_alike() -> None:
    assert set(NUMBERS) == set(TYPES)
    for name, number in NUMBERS.items():
        if not number.is_real:
            assert (number.low, number.high) == (TYPES[name].low, TYPES[name].high), name
        assert number.is_real == TYPES[name].is_real


@pytest.mark.parametrize(
    "wire, scale, offset, expected",
    [
        ("int16", 1.0, 0.0, ("INT", "")),
        ("int16", 0.1, 0.0, ("REAL", "REAL")),
        ("int32", 0.1, 0.0, ("LREAL", "LREAL")),
        ("int16", 0.001, 1e6, ("LREAL", "LREAL")),
        ("float32", 2.0, 0.0, ("REAL", "REAL")),
        ("float64", 2.0, 0.0, ("LREAL", "LREAL")),
        ("bool", 1.0, 0.0, ("BOOL", "")),
    ],
)
def test_types_of_values(wire: str, scale: float, offset: float, expected: tuple[str, str]) -> None:
    """A REAL where it tells all values apart."""
    assert value_type(ValueKind.FLOAT, wire, scale, offset) == expected
