"""Payloads, byte for byte against Google's own Protocol Buffers, and hostile bytes."""

from __future__ import annotations

import contextlib
import math
import random
import time
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.sparkplug.datatypes import ValueField, WireValue
from gatewayd.sparkplug.payload import (
    Metric,
    Payload,
    PayloadLimits,
    PropertySet,
    PropertyValue,
    decode_payload,
    encode_payload,
    encode_properties,
)
from gatewayd.sparkplug.wire import PayloadError, bytes_field, text_field, varint_field

ROOMY = PayloadLimits(size=1 << 20, metrics=10_000)
NUMBER, WIDE = st.integers(0, 0xFFFF_FFFF), st.integers(0, (1 << 64) - 1)
SCALARS = [
    st.builds(WireValue, st.just(ValueField.INT), NUMBER),
    st.builds(WireValue, st.just(ValueField.LONG), WIDE),
    st.builds(WireValue, st.just(ValueField.FLOAT), st.floats(width=32)),
    st.builds(WireValue, st.just(ValueField.DOUBLE), st.floats()),
    st.builds(WireValue, st.just(ValueField.BOOLEAN), st.booleans()),
    st.builds(WireValue, st.just(ValueField.STRING), st.text()),
]
PROPERTY = st.builds(
    PropertyValue, st.none() | NUMBER, st.none() | st.booleans(), st.none() | st.one_of(SCALARS)
)


def _nested(inner: st.SearchStrategy[PropertyValue]) -> st.SearchStrategy[PropertyValue]:
    def made(properties: PropertySet) -> PropertyValue:
        value = WireValue(ValueField.PROPERTY_SET, encode_properties(properties))
        return PropertyValue(20, None, value, (properties,))

    return st.lists(st.tuples(st.text(), inner), max_size=3).map(tuple).map(made)


PROPERTIES = st.lists(st.tuples(st.text(), st.recursive(PROPERTY, _nested, max_leaves=4)), max_size=4).map(
    tuple
)
METRIC = st.builds(
    Metric,
    name=st.none() | st.text(),
    alias=st.none() | WIDE,
    timestamp=st.none() | WIDE,
    datatype=st.none() | NUMBER,
    is_historical=st.none() | st.booleans(),
    is_transient=st.none() | st.booleans(),
    is_null=st.none() | st.booleans(),
    properties=st.none() | PROPERTIES,
    value=st.none() | st.one_of(*SCALARS, st.builds(WireValue, st.just(ValueField.BYTES), st.binary())),
)
PAYLOAD = st.builds(
    Payload,
    st.none() | WIDE,
    st.lists(METRIC, max_size=5).map(tuple),
    st.none() | WIDE,
    st.none() | st.text(),
    st.none() | st.binary(),
)


def same(mine: Any, theirs: Any, names: dict[str, str]) -> None:
    """The fields of a record of ours are those of a message of theirs, presence included."""
    for name, foreign_name in names.items():
        value = getattr(mine, name)
        assert theirs.HasField(foreign_name) is (value is not None)
        assert value is None or getattr(theirs, foreign_name) == value


def same_value(mine: WireValue | None, theirs: Any) -> None:
    """Which field of the oneof has which value."""
    name = theirs.WhichOneof("value")
    assert (None if mine is None else mine.field.value) == name
    if mine is None or not isinstance(content := getattr(theirs, name), bool | int | float | str | bytes):
        return
    assert mine.content == content or (math.isnan(float(content)) and math.isnan(float(mine.content)))


def same_properties(mine: PropertySet, theirs: Any) -> None:
    assert [key for key, _ in mine] == list(theirs.keys)
    for (_, value), foreign_value in zip(mine, theirs.values, strict=True):
        same(value, foreign_value, {"type": "type", "is_null": "is_null"})
        same_value(value.value, foreign_value)
        sets = {"propertyset_value": lambda one: [one.propertyset_value]} | {
            "propertysets_value": lambda one: one.propertysets_value.propertyset
        }
        inner = sets.get(foreign_value.WhichOneof("value"), lambda _: [])(foreign_value)
        for own, other in zip(value.sets, inner, strict=True):
            same_properties(own, other)


def same_payload(mine: Payload, theirs: Any) -> None:
    same(mine, theirs, {name: name for name in ("timestamp", "seq", "uuid", "body")})
    flags = ("name", "alias", "timestamp", "datatype", "is_historical", "is_transient", "is_null")
    for metric, foreign_metric in zip(mine.metrics, theirs.metrics, strict=True):
        same(metric, foreign_metric, {name: name for name in flags})
        same_value(metric.value, foreign_metric)
        assert foreign_metric.HasField("properties") is (metric.properties is not None)
        if metric.properties is not None:
            same_properties(metric.properties, foreign_metric.properties)


@given(PAYLOAD)
def test_payload_is_the_bytes_of_an_independent_implementation(payload: Payload) -> None:
    schema = pytest.importorskip("tests.sparkplug.schema")
    data = encode_payload(payload)
    theirs = schema.foreign(data)
    same_payload(payload, theirs)
    assert theirs.SerializeToString() == data


@given(PAYLOAD)
def test_payload_comes_back(payload: Payload) -> None:
    data = encode_payload(payload)
    again = decode_payload(data, ROOMY)
    assert encode_payload(again) == data
    assert repr(again) == repr(payload)


def test_payload_of_the_specification() -> None:
    """6.4.2's simple payload, as Google's implementation writes it."""
    schema = pytest.importorskip("tests.sparkplug.schema")
    theirs = schema.ForeignPayload(timestamp=1_486_144_502_122, seq=2)
    metric = theirs.metrics.add(name="My Metric", alias=1, timestamp=1_479_123_452_194, datatype=12)
    metric.string_value = "Test"
    mine = Payload(
        timestamp=1_486_144_502_122,
        metrics=(Metric("My Metric", 1, 1_479_123_452_194, 12, value=WireValue(ValueField.STRING, "Test")),),
        seq=2,
    )
    assert encode_payload(mine) == theirs.SerializeToString()
    assert decode_payload(theirs.SerializeToString()) == mine


def _rich() -> Any:
    """A payload with everything in it that the schema has, from a foreign writer."""
    schema = pytest.importorskip("tests.sparkplug.schema")
    theirs = schema.ForeignPayload(timestamp=5, seq=1, uuid="u", body=b"b")
    table = theirs.metrics.add(name="table", datatype=16)
    table.metadata.description = "d"
    table.dataset_value.num_of_columns = 1
    table.dataset_value.columns.append("a")
    table.dataset_value.types.append(3)
    table.dataset_value.rows.add().elements.add().int_value = 4
    template = theirs.metrics.add(name="template", datatype=19).template_value
    template.parameters.add(name="p", type=3).int_value = 1
    template.metrics.add(name="inner").int_value = 2
    inner = theirs.metrics.add(alias=7, is_null=True)
    inner.properties.keys.extend(["Quality", "list"])
    inner.properties.values.add(type=3).int_value = 192
    several = inner.properties.values.add(type=21).propertysets_value.propertyset
    several.add().keys.append("engUnit")
    several[0].values.add(type=12).string_value = "mm"
    theirs.metrics.add(name="ext").extension_value.SetInParent()
    return theirs


def test_data_sets_templates_and_metadata_are_tolerated() -> None:
    theirs = _rich()
    mine = decode_payload(theirs.SerializeToString())
    same_payload(mine, theirs)
    fields = [metric.value.field if metric.value else None for metric in mine.metrics]
    assert fields == [ValueField.DATA_SET, ValueField.TEMPLATE, None, ValueField.EXTENSION]
    properties = mine.metrics[2].properties
    assert properties is not None
    assert properties[1][1].sets == (
        (("engUnit", PropertyValue(12, None, WireValue(ValueField.STRING, "mm"))),),
    )


@settings(max_examples=200)
@given(st.binary(max_size=200))
def test_any_bytes_are_a_payload_or_refused(data: bytes) -> None:
    _read_as_they_do(data)


def test_mutated_payloads_are_read_as_others_do_or_refused() -> None:
    """Bits turned, bytes cut, doubled and exchanged: whatever we read, an independent reader reads as we do."""
    chance = random.Random(3)
    whole = _rich().SerializeToString()
    read = 0
    for _ in range(5000):
        data = bytearray(whole)
        for _ in range(chance.randint(1, 4)):
            at, other = chance.randrange(len(data)), chance.randrange(len(data))
            match chance.randrange(5):
                case 0:
                    data[at] ^= 1 << chance.randrange(8)
                case 1:
                    data[at] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
                case 2:
                    del data[min(at, other) : min(at, other) + chance.randint(0, len(data) - 1)]
                case 3:
                    data[at:at] = data[min(at, other) : max(at, other)][:64]
                case _:
                    data[at : at + 4] = chance.randbytes(4)
            if not data:
                data = bytearray(b"\x08")
        read += _read_as_they_do(bytes(data))
    assert read > 300


def _read_as_they_do(data: bytes) -> bool:
    """Whether the bytes are a payload. Nothing but a PayloadError is raised."""
    schema = pytest.importorskip("tests.sparkplug.schema")
    with contextlib.suppress(PayloadError):
        mine = decode_payload(data, ROOMY)
        # They look into data sets and templates, and into what we skip.
        with contextlib.suppress(schema.DecodeError):
            same_payload(mine, schema.foreign(data))
            return True
    return False


@pytest.mark.parametrize(
    "data, words",
    [
        (bytes(65_537), "65537 bytes; at most 65536"),
        (bytes_field(2, b"") * 2049, "over 2048 metrics"),
        (bytes_field(2, text_field(1, "a")[:-1] + b"\xff"), "not UTF-8"),
        (bytes_field(2, bytes_field(9, text_field(1, "a"))), "unequal numbers: 1 and 0"),
        (bytes_field(2, b"\x0a\x05a"), "too early"),
    ],
)
def test_what_is_refused_is_said(data: bytes, words: str) -> None:
    with pytest.raises(PayloadError, match=words):
        decode_payload(data)


def test_depth_of_properties_is_bounded() -> None:
    properties = b""
    for _ in range(20):
        properties = text_field(1, "a") + bytes_field(2, bytes_field(9, properties))
    with pytest.raises(PayloadError, match="in each other"):
        decode_payload(bytes_field(2, bytes_field(9, properties)))


def test_the_last_value_counts_and_messages_are_merged() -> None:
    schema = pytest.importorskip("tests.sparkplug.schema")
    one, two = (text_field(1, key) + bytes_field(2, varint_field(3, 1)) for key in "ab")
    metric = bytes_field(9, one) + varint_field(10, 5) + bytes_field(9, two) + text_field(15, "x")
    mine = decode_payload(bytes_field(2, metric))
    same_payload(mine, schema.foreign(bytes_field(2, metric)))
    assert mine.metrics[0].value == WireValue(ValueField.STRING, "x")
    assert len(mine.metrics[0].properties or ()) == 2


def test_a_field_of_another_wire_type_is_skipped() -> None:
    assert decode_payload(varint_field(2, 5) + text_field(1, "x") + varint_field(77, 1)) == Payload()


def test_the_worst_that_is_read_takes_little_time() -> None:
    """64 KiB of the smallest fields, of metrics, and of nested properties: the loop of a gateway reads commands."""
    small = varint_field(1, 1) * 32_768
    metrics = bytes_field(2, b"") * 2048 + varint_field(3, 1) * 30_000
    values = bytes_field(2, bytes_field(9, (b"\x0a\0\x12\0") * 16_000))
    slowest = 0.0
    for data in (small, metrics[:65_536], values):
        begun = time.process_time()
        decode_payload(data)
        slowest = max(slowest, time.process_time() - begun)
    print(f"slowest: {slowest * 1000:.1f} ms")
    assert slowest < 1.0
