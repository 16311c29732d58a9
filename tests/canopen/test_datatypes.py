"""Codes, lengths and bytes of the data types."""

from __future__ import annotations

import math
import struct

import pytest
from canopen.objectdictionary import datatypes

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Value


@pytest.mark.parametrize("kind", CanType, ids=lambda kind: kind.name)
def test_codes_are_those_of_the_standard(kind: CanType) -> None:
    """An independent implementation has the same numbers."""
    assert getattr(datatypes, kind.name) == kind.code


@pytest.mark.parametrize(
    "kind,value,data",
    [
        (CanType.BOOLEAN, True, "01"),
        (CanType.INTEGER8, -2, "fe"),
        (CanType.INTEGER16, -2, "feff"),
        (CanType.UNSIGNED16, 0x1234, "3412"),
        (CanType.UNSIGNED32, 0x1234_5678, "78563412"),
        (CanType.INTEGER64, -1, "ffffffffffffffff"),
        (CanType.UNSIGNED64, 1, "0100000000000000"),
        (CanType.REAL32, 1.0, "0000803f"),
        (CanType.REAL64, 1.0, "000000000000f03f"),
    ],
)
def test_bytes_are_little_endian(kind: CanType, value: Value, data: str) -> None:
    assert kind.pack(value) == bytes.fromhex(data)
    assert kind.unpack(bytes.fromhex(data)) == value
    assert kind.size == len(data) // 2


def test_a_pdo_carries_a_boolean_in_one_bit() -> None:
    assert (CanType.BOOLEAN.bits, CanType.BOOLEAN.size) == (1, 1)


@pytest.mark.parametrize("kind", [CanType.VISIBLE_STRING, CanType.DOMAIN], ids=lambda kind: kind.name)
def test_strings_have_no_length_of_their_own(kind: CanType) -> None:
    assert (kind.size, kind.bits) == (None, 0)


def test_what_does_not_fit_is_no_number_of_the_type() -> None:
    with pytest.raises(struct.error):
        CanType.INTEGER16.pack(40_000)
    with pytest.raises(OverflowError):
        CanType.REAL32.pack(1e300)
    assert CanType.REAL32.pack(math.inf) == bytes.fromhex("0000807f")
