"""The content of PDOs that devices have laid out."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.manager.pdo_content import PdoContent
from gatewayd.canopen.manager.plan import PdoObject


def _object(bits: int, kind: CanType | None = None) -> PdoObject:
    return PdoObject(0x2000, 1, bits, kind)


def test_numbers_lie_least_significant_bit_first() -> None:
    content = PdoContent(
        [
            _object(1, CanType.BOOLEAN),
            _object(3),
            _object(16, CanType.INTEGER16),
            _object(24),
            _object(8, CanType.UNSIGNED8),
        ]
    )
    assert content.size == 7
    data = content.pack([True, 5, -2, 0x123456, 9])
    assert data.hex() == "ebff6f4523910 0".replace(" ", "")
    assert content.unpack(data) == [True, 5, -2, 0x123456, 9]


def test_real_numbers() -> None:
    content = PdoContent([_object(32, CanType.REAL32), _object(32, CanType.REAL32)])
    assert content.pack([1.5, -0.25]) == struct.pack("<ff", 1.5, -0.25)
    assert content.unpack(struct.pack("<ff", 1.5, -0.25)) == [1.5, -0.25]
    single = PdoContent([_object(64, CanType.REAL64)])
    assert single.unpack(single.pack([-7.125])) == [-7.125]


def test_bits_of_the_layout_count_where_the_type_has_others() -> None:
    content = PdoContent(
        [_object(8, CanType.BOOLEAN), _object(24, CanType.INTEGER32), _object(16, CanType.REAL32)]
    )
    assert content.unpack(bytes.fromhex("01ffffff0102")) == [True, -1, 0x201]


def test_objects_without_bits_and_too_many_bits_are_refused() -> None:
    with pytest.raises(ValueError, match="2000h:01 has no bits"):
        PdoContent([_object(0, CanType.DOMAIN)])
    with pytest.raises(ValueError, match="65 bits do not fit"):
        PdoContent([_object(64), _object(1)])


widths = st.lists(st.integers(1, 32), max_size=8).filter(lambda bits: sum(bits) <= 64)


@given(widths, st.binary(min_size=8, max_size=8))
def test_any_layout_there_and_back(bits: list[int], data: bytes) -> None:
    content = PdoContent([_object(width) for width in bits])
    values = content.unpack(data)
    assert content.unpack(content.pack(values)) == values


def test_numbers_that_are_too_wide_lose_their_highest_bits_and_touch_no_neighbour() -> None:
    content = PdoContent([_object(4), _object(4)])
    assert content.pack([0x1F, -1]) == b"\xff"
    assert content.pack([0x10, 0]) == b"\x00"
