"""Values of metrics: every type both ways, the signed in their unsigned fields, and what does not fit."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.sparkplug.datatypes import (
    MetricType,
    Scalar,
    ValueField,
    WireValue,
    commanded_value,
    decode_value,
    encode_value,
    range_of,
)
from gatewayd.sparkplug.wire import PayloadError

INTEGERS = [one for one in MetricType if 1 <= one <= 8 or one is MetricType.DATE_TIME]
ARRAYS = [one for one in MetricType if one >= MetricType.INT8_ARRAY]
INT, LONG, FLOAT, DOUBLE, BOOLEAN, STRING, BYTES = list(ValueField)[:7]


def test_names_and_numbers_are_those_of_the_specification() -> None:
    labels = [one.label for one in MetricType]
    basic = (
        "Unknown Int8 Int16 Int32 Int64 UInt8 UInt16 UInt32 UInt64 Float Double Boolean String DateTime Text"
    )
    arrays = "Int8 Int16 Int32 Int64 UInt8 UInt16 UInt32 UInt64 Float Double Boolean String DateTime"
    assert " ".join(labels[:15]) == basic
    assert " ".join(labels[15:22]) == "UUID DataSet Bytes File Template PropertySet PropertySetList"
    assert labels[22:] == [f"{name}Array" for name in arrays.split()]
    assert list(MetricType) == list(range(35))


@pytest.mark.parametrize("kind", INTEGERS, ids=lambda kind: kind.label)
def test_integers_come_back(kind: MetricType) -> None:
    least, greatest = range_of(kind)
    for value in {least, -1, 0, 1, greatest} & set(range(max(least, -1), 2)) | {least, greatest}:
        wire = encode_value(kind, value)
        assert wire.field is (LONG if kind in (4, 8, 13) else INT)
        assert decode_value(kind, wire) == value
    for value in (least - 1, greatest + 1):
        with pytest.raises(PayloadError, match="beyond the type"):
            encode_value(kind, value)


@pytest.mark.parametrize(
    "kind, field, raw, value",
    [
        (MetricType.INT8, INT, 0xFFFF_FFFF, -1),
        (MetricType.INT8, INT, 0xFF, -1),
        (MetricType.INT8, INT, 0x80, -128),
        (MetricType.INT16, INT, 0xFFFF_8000, -32768),
        (MetricType.INT16, INT, 0x8000, -32768),
        (MetricType.INT32, INT, 0x8000_0000, -(1 << 31)),
        (MetricType.INT32, LONG, (1 << 64) - 5, -5),
        (MetricType.INT64, LONG, (1 << 64) - 5, -5),
        (MetricType.INT64, INT, 0xFFFF_FFFB, -5),
        (MetricType.UINT32, LONG, 0xFFFF_FFFF, 0xFFFF_FFFF),
        (MetricType.DATE_TIME, LONG, 1_486_144_502_122, 1_486_144_502_122),
    ],
)
def test_signed_values_in_unsigned_fields(kind: MetricType, field: ValueField, raw: int, value: int) -> None:
    """Sign-extended to the field as Tahu's Java writes it, in the type's own bits as Tahu's Python does, in the other
    field as well.
    """
    assert decode_value(kind, WireValue(field, raw)) == value


def test_negative_numbers_are_written_as_most_read_them() -> None:
    assert encode_value(MetricType.INT8, -1) == WireValue(INT, 0xFFFF_FFFF)
    assert encode_value(MetricType.INT64, -1) == WireValue(LONG, 0xFFFF_FFFF_FFFF_FFFF)


@pytest.mark.parametrize(
    "kind, wire",
    [
        (MetricType.INT8, WireValue(INT, 256)),
        (MetricType.UINT8, WireValue(INT, 0xFFFF_FFFF)),
        (MetricType.INT32, WireValue(LONG, 0xFFFF_FFFF)),
        (MetricType.INT32, WireValue(STRING, "5")),
        (MetricType.INT32, WireValue(DOUBLE, 5.0)),
        (MetricType.DOUBLE, WireValue(INT, 5)),
        (MetricType.FLOAT, WireValue(DOUBLE, 1e300)),
        (MetricType.BOOLEAN, WireValue(INT, 1)),
        (MetricType.STRING, WireValue(BYTES, b"a")),
        (MetricType.BYTES, WireValue(STRING, "a")),
        (MetricType.UNKNOWN, WireValue(INT, 1)),
        (MetricType.DATA_SET, WireValue(ValueField.DATA_SET, b"")),
        (MetricType.TEMPLATE, WireValue(ValueField.TEMPLATE, b"")),
        (MetricType.PROPERTY_SET, WireValue(ValueField.PROPERTY_SET, b"")),
    ],
)
def test_a_value_of_another_type_is_refused(kind: MetricType, wire: WireValue) -> None:
    with pytest.raises(PayloadError, match=kind.label):
        decode_value(kind, wire)


@pytest.mark.parametrize(
    "kind, value",
    [
        (MetricType.BOOLEAN, True),
        (MetricType.STRING, "Größe"),
        (MetricType.TEXT, ""),
        (MetricType.UUID, "a5b1"),
        (MetricType.BYTES, b"\0\xff"),
        (MetricType.FILE, b"PK"),
        (MetricType.DOUBLE, 0.1),
        (MetricType.DOUBLE, math.inf),
        (MetricType.FLOAT, 0.5),
        *((kind, struct.pack("<3I", 1, 2, 3)) for kind in ARRAYS),
    ],
)
def test_other_types_come_back(kind: MetricType, value: Scalar) -> None:
    assert decode_value(kind, encode_value(kind, value)) == value


def test_float_is_rounded_as_the_wire_has_it() -> None:
    assert encode_value(MetricType.FLOAT, 0.1).content == struct.unpack("<f", struct.pack("<f", 0.1))[0]
    assert decode_value(MetricType.DOUBLE, WireValue(FLOAT, 0.5)) == 0.5
    assert math.isnan(float(decode_value(MetricType.FLOAT, encode_value(MetricType.FLOAT, math.nan))))
    assert encode_value(MetricType.DOUBLE, 5) == WireValue(DOUBLE, 5.0)


@pytest.mark.parametrize(
    "kind, value",
    [(MetricType.BOOLEAN, 1), (MetricType.INT8, 1.0), (MetricType.STRING, b"a"), (MetricType.TEMPLATE, b"")],
)
def test_what_cannot_be_written_is_refused(kind: MetricType, value: Scalar) -> None:
    with pytest.raises(PayloadError, match="no value of the type"):
        encode_value(kind, value)


@pytest.mark.parametrize(
    "wanted, said, wire, value",
    [
        (MetricType.INT32, None, WireValue(INT, 7), 7),
        (MetricType.INT32, 0, WireValue(INT, 7), 7),
        (MetricType.INT32, MetricType.INT64, WireValue(LONG, (1 << 64) - 7), -7),
        (MetricType.INT32, MetricType.INT8, WireValue(INT, 0xF9), -7),
        (MetricType.DOUBLE, MetricType.FLOAT, WireValue(FLOAT, 0.5), 0.5),
        (MetricType.DOUBLE, MetricType.INT32, WireValue(INT, 0xFFFF_FFFF), -1.0),
        (MetricType.STRING, MetricType.TEXT, WireValue(STRING, "a"), "a"),
    ],
)
def test_a_command_of_another_type_is_converted_if_nothing_is_lost(
    wanted: MetricType, said: int | None, wire: WireValue, value: Scalar
) -> None:
    assert commanded_value(wanted, said, wire) == value


@pytest.mark.parametrize(
    "wanted, said, wire, words",
    [
        (MetricType.INT32, MetricType.INT64, WireValue(LONG, 1 << 40), "beyond the type Int32"),
        (MetricType.UINT8, MetricType.INT8, WireValue(INT, 0xFF), "-1 is beyond"),
        (MetricType.DOUBLE, MetricType.INT64, WireValue(LONG, (1 << 53) + 1), "of the type Int64"),
        (MetricType.INT32, MetricType.DOUBLE, WireValue(DOUBLE, 1.0), "of the type Double"),
        (MetricType.BOOLEAN, MetricType.INT32, WireValue(INT, 1), "of the type Int32"),
        (MetricType.INT32, 77, WireValue(INT, 1), "no data type 77"),
        (MetricType.INT32, MetricType.TEMPLATE, WireValue(INT, 1), "type Template"),
    ],
)
def test_a_command_of_another_type_that_would_lose_is_refused(
    wanted: MetricType, said: int, wire: WireValue, words: str
) -> None:
    with pytest.raises(PayloadError, match=words):
        commanded_value(wanted, said, wire)


ANY_WIRE_VALUE = st.one_of(
    st.builds(WireValue, st.just(INT), st.integers(0, 0xFFFF_FFFF)),
    st.builds(WireValue, st.just(LONG), st.integers(0, (1 << 64) - 1)),
    st.builds(WireValue, st.just(FLOAT), st.floats(width=32)),
    st.builds(WireValue, st.just(DOUBLE), st.floats()),
    st.builds(WireValue, st.just(BOOLEAN), st.booleans()),
    st.builds(WireValue, st.just(STRING), st.text()),
    st.builds(WireValue, st.sampled_from(list(ValueField)[6:]), st.binary()),
)


@given(st.sampled_from(MetricType), st.none() | st.integers(0, 40), ANY_WIRE_VALUE)
def test_a_command_is_a_value_of_the_metric_or_refused(
    wanted: MetricType, said: int | None, wire: WireValue
) -> None:
    try:
        value = commanded_value(wanted, said, wire)
    except PayloadError:
        return
    again = decode_value(wanted, encode_value(wanted, value))
    assert again == value or math.isnan(float(again))
