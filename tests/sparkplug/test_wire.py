"""The encoding of Protocol Buffers: what is read, skipped and refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.sparkplug.wire import MAX_UINT64, PayloadError, read_fields, varint, varint_field


@pytest.mark.parametrize(
    "data, fields",
    [
        ("", []),
        ("0896 01", [(1, 0, 150)]),
        ("1203 616263", [(2, 2, b"abc")]),
        ("0d 0000803f", [(1, 5, b"\0\0\x80?")]),
        ("09 000000000000f03f", [(1, 1, b"\0\0\0\0\0\0\xf0?")]),
        ("0b 0801 0c 1005", [(2, 0, 5)]),
        ("0b 13 0801 14 0c 1005", [(2, 0, 5)]),
        ("08 ffffffffffffffffff01", [(1, 0, MAX_UINT64)]),
        ("08 ffffffffffffffffff7f", [(1, 0, MAX_UINT64)]),
    ],
    ids=[
        "empty",
        "varint",
        "bytes",
        "fixed32",
        "fixed64",
        "group",
        "groups",
        "greatest",
        "more_than_64_bits",
    ],
)
def test_fields_of_a_message(data: str, fields: list[object]) -> None:
    assert list(read_fields(bytes.fromhex(data))) == fields


@pytest.mark.parametrize(
    "data, words",
    [
        ("08", "in the middle of a number"),
        ("0896", "in the middle of a number"),
        ("08 ffffffffffffffffffff01", "over 10 bytes"),
        ("1205 6162", "too early; missing bytes: 3"),
        ("12 ffffffff0f 61", "too early"),
        ("12 ffffffffffffffffff01 61", "too early"),
        ("0d 0000", "missing bytes: 2"),
        ("0001", "number 0"),
        ("88808080 80 01 00", "has a field with the number"),
        ("0c", "wire type 4"),
        ("0e", "wire type 6"),
        ("0f", "wire type 7"),
        ("0b 0801", "in the middle of a number"),
        ("0b 0801 14", "has not begun"),
        ("0b" * 40, "over 32 groups"),
    ],
)
def test_what_is_no_message_is_refused_with_words(data: str, words: str) -> None:
    with pytest.raises(PayloadError, match=words):
        list(read_fields(bytes.fromhex(data)))


@given(st.integers(0, MAX_UINT64), st.integers(1, (1 << 29) - 1))
def test_every_number_is_read_as_it_was_written(value: int, number: int) -> None:
    assert list(read_fields(varint_field(number, value))) == [(number, 0, value)]
    assert len(varint(value)) == max(1, -(-value.bit_length() // 7))
