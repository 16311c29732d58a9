"""Payloads of Sparkplug B: the messages of the published schema `org.eclipse.tahu.protobuf` (specification 6.4).

Written and read are what an edge node has to do with: payloads, metrics and their properties. Data sets and templates
are accepted as the bytes they are; metadata and extensions are skipped. Whatever arrives is bounded in size, number of
metrics and depth, and can raise nothing but `PayloadError`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gatewayd.sparkplug.datatypes import Scalar, ValueField, WireValue
from gatewayd.sparkplug.wire import (
    BYTES,
    FIXED32,
    FIXED64,
    MAX_UINT32,
    VARINT,
    Content,
    PayloadError,
    bytes_field,
    double_field,
    double_of,
    float_field,
    float_of,
    read_fields,
    text_field,
    text_of,
    varint_field,
)


@dataclass(frozen=True, slots=True)
class PayloadLimits:
    """What is read at most: a publisher must not decide how long a reader works."""

    size: int = 64 * 1024
    """Bytes of a payload."""
    metrics: int = 2048
    depth: int = 8
    """Property sets in each other; 0 skips properties."""


DEFAULT_LIMITS = PayloadLimits()


@dataclass(frozen=True, slots=True)
class PropertyValue:
    """A value of a property set."""

    type: int | None = None
    is_null: bool | None = None
    value: WireValue | None = None
    sets: tuple[PropertySet, ...] = ()
    """Where the value is a property set, or a list of them."""


PropertySet = tuple[tuple[str, PropertyValue], ...]
"""Keys and values, in their order."""


@dataclass(frozen=True, slots=True)
class Metric:
    """A metric of a payload. None is what is not there."""

    name: str | None = None
    alias: int | None = None
    timestamp: int | None = None
    """Milliseconds of UTC since 1970, when the value was captured."""
    datatype: int | None = None
    is_historical: bool | None = None
    is_transient: bool | None = None
    is_null: bool | None = None
    properties: PropertySet | None = None
    value: WireValue | None = None


@dataclass(frozen=True, slots=True)
class Payload:
    """A payload. None is what is not there."""

    timestamp: int | None = None
    """Milliseconds of UTC since 1970, when the message was sent."""
    metrics: tuple[Metric, ...] = ()
    seq: int | None = None
    uuid: str | None = None
    body: bytes | None = None


_METRIC_VALUES = {
    10: ValueField.INT,
    11: ValueField.LONG,
    12: ValueField.FLOAT,
    13: ValueField.DOUBLE,
    14: ValueField.BOOLEAN,
    15: ValueField.STRING,
    16: ValueField.BYTES,
    17: ValueField.DATA_SET,
    18: ValueField.TEMPLATE,
    19: ValueField.EXTENSION,
}
_PROPERTY_VALUES = {
    3: ValueField.INT,
    4: ValueField.LONG,
    5: ValueField.FLOAT,
    6: ValueField.DOUBLE,
    7: ValueField.BOOLEAN,
    8: ValueField.STRING,
    9: ValueField.PROPERTY_SET,
    10: ValueField.PROPERTY_SET_LIST,
    11: ValueField.EXTENSION,
}
_METRIC_NUMBERS = {field: number for number, field in _METRIC_VALUES.items()}
_PROPERTY_NUMBERS = {field: number for number, field in _PROPERTY_VALUES.items()}
_WIRE_TYPES = {
    ValueField.INT: VARINT,
    ValueField.LONG: VARINT,
    ValueField.FLOAT: FIXED32,
    ValueField.DOUBLE: FIXED64,
    ValueField.BOOLEAN: VARINT,
}
"""Of the value fields; the others are BYTES."""
_MESSAGES = {
    ValueField.DATA_SET,
    ValueField.TEMPLATE,
    ValueField.PROPERTY_SET,
    ValueField.PROPERTY_SET_LIST,
    ValueField.EXTENSION,
}


# -- Reading -----------------------------------------------------------------------------------------------------------


def decode_payload(data: bytes, limits: PayloadLimits = DEFAULT_LIMITS) -> Payload:
    """The payload of a message."""
    if len(data) > limits.size:
        raise PayloadError(f"has {len(data)} bytes; at most {limits.size} are read")
    timestamp = seq = uuid = body = None
    metrics: list[Metric] = []
    for number, content in _known(data, _PAYLOAD_FIELDS):
        if isinstance(content, bytes):
            if number == 2:
                if len(metrics) >= limits.metrics:
                    raise PayloadError(f"has over {limits.metrics} metrics")
                metrics.append(_decode_metric(content, limits))
            elif number == 4:
                uuid = text_of(content)
            else:
                body = content
        elif number == 1:
            timestamp = content
        else:
            seq = content
    return Payload(timestamp, tuple(metrics), seq, uuid, body)


_PAYLOAD_FIELDS = {1: VARINT, 2: BYTES, 3: VARINT, 4: BYTES, 5: BYTES}
_METRIC_FIELDS = {1: BYTES, **dict.fromkeys(range(2, 8), VARINT), 9: BYTES} | {
    number: _WIRE_TYPES.get(field, BYTES) for number, field in _METRIC_VALUES.items()
}
_PROPERTY_SET_FIELDS = {1: BYTES, 2: BYTES}
_PROPERTY_LIST_FIELDS = {1: BYTES}
_PROPERTY_FIELDS = {1: VARINT, 2: VARINT} | {
    number: _WIRE_TYPES.get(field, BYTES) for number, field in _PROPERTY_VALUES.items()
}


def _known(data: bytes, fields: dict[int, int]) -> Iterator[tuple[int, Content]]:
    """Fields of the message as the schema has them. With another wire type a field is unknown, and skipped."""
    for number, wire_type, content in read_fields(data):
        if fields.get(number) == wire_type:
            yield number, content


def _decode_metric(data: bytes, limits: PayloadLimits) -> Metric:
    name: str | None = None
    properties: bytes | None = None
    value: WireValue | None = None
    numbers: dict[int, int] = {}
    for number, content in _known(data, _METRIC_FIELDS):
        if number in _METRIC_VALUES:
            value = _next_value(value, _METRIC_VALUES[number], content)
        elif isinstance(content, int):
            numbers[number] = content
        elif number == 1:
            name = text_of(content)
        else:
            # A message that occurs twice in a field for one is merged: what its bytes in a row mean.
            properties = (properties or b"") + content
    return Metric(
        name=name,
        alias=numbers.get(2),
        timestamp=numbers.get(3),
        datatype=_narrow(numbers.get(4)),
        is_historical=_truth(numbers.get(5)),
        is_transient=_truth(numbers.get(6)),
        is_null=_truth(numbers.get(7)),
        properties=_decode_properties(properties, limits.depth)
        if properties is not None and limits.depth
        else None,
        value=value,
    )


def _decode_properties(data: bytes, depth: int) -> PropertySet:
    if depth == 0:
        raise PayloadError("has too many property sets in each other")
    keys: list[str] = []
    values: list[PropertyValue] = []
    for number, content in _known(data, _PROPERTY_SET_FIELDS):
        assert isinstance(content, bytes)
        if number == 1:
            keys.append(text_of(content))
        else:
            values.append(_decode_property(content, depth))
    if len(keys) != len(values):
        raise PayloadError(
            f"has a property set with keys and values in unequal numbers: {len(keys)} and {len(values)}"
        )
    return tuple(zip(keys, values, strict=True))


def _decode_property(data: bytes, depth: int) -> PropertyValue:
    kind = is_null = None
    value: WireValue | None = None
    for number, content in _known(data, _PROPERTY_FIELDS):
        if number in _PROPERTY_VALUES:
            value = _next_value(value, _PROPERTY_VALUES[number], content)
        elif number == 1:
            kind = content
        else:
            is_null = content
    sets: tuple[PropertySet, ...] = ()
    if value is not None and isinstance(value.content, bytes):
        if value.field is ValueField.PROPERTY_SET:
            sets = (_decode_properties(value.content, depth - 1),)
        elif value.field is ValueField.PROPERTY_SET_LIST:
            sets = tuple(
                _decode_properties(content, depth - 1)
                for _, content in _known(value.content, _PROPERTY_LIST_FIELDS)
                if isinstance(content, bytes)
            )
    return PropertyValue(_narrow(kind), _truth(is_null), value, sets)


def _next_value(former: WireValue | None, field: ValueField, content: Content) -> WireValue:
    """The last value counts; a message that occurs twice is merged."""
    if former is not None and former.field is field and field in _MESSAGES:
        assert isinstance(former.content, bytes)
        assert isinstance(content, bytes)
        content = former.content + content
    return WireValue(field, _content_of(field, content))


def _content_of(field: ValueField, content: Content) -> Scalar:
    if isinstance(content, int):
        if field is ValueField.BOOLEAN:
            return content != 0
        return content & MAX_UINT32 if field is ValueField.INT else content
    if field is ValueField.FLOAT:
        return float_of(content)
    if field is ValueField.DOUBLE:
        return double_of(content)
    return text_of(content) if field is ValueField.STRING else content


def _narrow(number: int | bytes | None) -> int | None:
    """A uint32: of a greater number its low bits count."""
    return number & MAX_UINT32 if isinstance(number, int) else None


def _truth(number: int | bytes | None) -> bool | None:
    return None if number is None else number != 0


# -- Writing -----------------------------------------------------------------------------------------------------------


def encode_payload(payload: Payload) -> bytes:
    """The bytes of a payload, its fields in the order of their numbers, as other writers have them."""
    parts = []
    if payload.timestamp is not None:
        parts.append(varint_field(1, payload.timestamp))
    parts += (bytes_field(2, encode_metric(metric)) for metric in payload.metrics)
    if payload.seq is not None:
        parts.append(varint_field(3, payload.seq))
    if payload.uuid is not None:
        parts.append(text_field(4, payload.uuid))
    if payload.body is not None:
        parts.append(bytes_field(5, payload.body))
    return b"".join(parts)


def encode_metric(metric: Metric) -> bytes:
    """The bytes of a metric."""
    parts = []
    if metric.name is not None:
        parts.append(text_field(1, metric.name))
    numbers = (
        (2, metric.alias),
        (3, metric.timestamp),
        (4, metric.datatype),
        (5, metric.is_historical),
        (6, metric.is_transient),
        (7, metric.is_null),
    )
    parts += (varint_field(number, value) for number, value in numbers if value is not None)
    if metric.properties is not None:
        parts.append(bytes_field(9, encode_properties(metric.properties)))
    if metric.value is not None:
        parts.append(_encode_value(_METRIC_NUMBERS[metric.value.field], metric.value))
    return b"".join(parts)


def encode_properties(properties: PropertySet) -> bytes:
    """The bytes of a property set: all keys, then all values."""
    keys = [text_field(1, key) for key, _ in properties]
    return b"".join(keys + [bytes_field(2, _encode_property(value)) for _, value in properties])


def _encode_property(one: PropertyValue) -> bytes:
    parts = []
    if one.type is not None:
        parts.append(varint_field(1, one.type))
    if one.is_null is not None:
        parts.append(varint_field(2, one.is_null))
    if one.value is not None:
        parts.append(_encode_value(_PROPERTY_NUMBERS[one.value.field], one.value))
    return b"".join(parts)


def _encode_value(number: int, value: WireValue) -> bytes:
    content = value.content
    if isinstance(content, int):
        return varint_field(number, content)
    if isinstance(content, float):
        return (float_field if value.field is ValueField.FLOAT else double_field)(number, content)
    return text_field(number, content) if isinstance(content, str) else bytes_field(number, content)
