"""The data types of metrics, and their values (specification 6.4.16).

A signed number lies in an unsigned field, as its two's complement. Implementations differ in how wide that is: Eclipse
Tahu's Java and JavaScript libraries extend the sign of Int8 and Int16 to 32 bits, its Python library does not. We write
the former, which all read, and read both.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import Enum, IntEnum

from gatewayd.sparkplug.wire import MAX_UINT32, MAX_UINT64, PayloadError

Scalar = bool | int | float | str | bytes


class MetricType(IntEnum):
    """The numbers are the specification's; its names are in CamelCase (`label`)."""

    UNKNOWN = 0
    INT8 = 1
    INT16 = 2
    INT32 = 3
    INT64 = 4
    UINT8 = 5
    UINT16 = 6
    UINT32 = 7
    UINT64 = 8
    FLOAT = 9
    DOUBLE = 10
    BOOLEAN = 11
    STRING = 12
    DATE_TIME = 13
    TEXT = 14
    UUID = 15
    DATA_SET = 16
    BYTES = 17
    FILE = 18
    TEMPLATE = 19
    PROPERTY_SET = 20
    PROPERTY_SET_LIST = 21
    INT8_ARRAY = 22
    INT16_ARRAY = 23
    INT32_ARRAY = 24
    INT64_ARRAY = 25
    UINT8_ARRAY = 26
    UINT16_ARRAY = 27
    UINT32_ARRAY = 28
    UINT64_ARRAY = 29
    FLOAT_ARRAY = 30
    DOUBLE_ARRAY = 31
    BOOLEAN_ARRAY = 32
    STRING_ARRAY = 33
    DATE_TIME_ARRAY = 34

    @property
    def label(self) -> str:
        """As the specification writes it: `UInt16Array`."""
        if self is MetricType.UUID:
            return "UUID"
        return "".join(part.capitalize() for part in self.name.split("_")).replace("Uint", "UInt")


class ValueField(Enum):
    """Which field of a `oneof value` has the value: the schema has them in metrics and in properties."""

    INT = "int_value"
    LONG = "long_value"
    FLOAT = "float_value"
    DOUBLE = "double_value"
    BOOLEAN = "boolean_value"
    STRING = "string_value"
    BYTES = "bytes_value"
    DATA_SET = "dataset_value"
    TEMPLATE = "template_value"
    PROPERTY_SET = "propertyset_value"
    PROPERTY_SET_LIST = "propertysets_value"
    EXTENSION = "extension_value"


@dataclass(frozen=True, slots=True)
class WireValue:
    """A value as it lies in a payload. Messages (data sets, templates, extensions) are kept as their bytes."""

    field: ValueField
    content: Scalar


_SIGNED = {MetricType.INT8: 8, MetricType.INT16: 16, MetricType.INT32: 32, MetricType.INT64: 64}
_UNSIGNED = {
    MetricType.UINT8: 8,
    MetricType.UINT16: 16,
    MetricType.UINT32: 32,
    MetricType.UINT64: 64,
    MetricType.DATE_TIME: 64,
}
_REALS = {MetricType.FLOAT: ValueField.FLOAT, MetricType.DOUBLE: ValueField.DOUBLE}
_TEXTS = {MetricType.STRING, MetricType.TEXT, MetricType.UUID}
_BINARY = {MetricType.BYTES, MetricType.FILE, *(one for one in MetricType if one >= MetricType.INT8_ARRAY)}
_INTEGERS = _SIGNED.keys() | _UNSIGNED.keys()
_FLOAT = struct.Struct("<f")
_EXACT = 1 << 53
"""Integers up to this are exact as doubles."""


def range_of(metric_type: MetricType) -> tuple[int, int]:
    """Least and greatest value of an integer type."""
    if metric_type in _SIGNED:
        half = 1 << _SIGNED[metric_type] - 1
        return -half, half - 1
    return 0, (1 << _UNSIGNED[metric_type]) - 1


def encode_value(metric_type: MetricType, value: Scalar) -> WireValue:
    """A value of a metric of this type. PayloadError if the type cannot hold it."""
    if metric_type in _INTEGERS and isinstance(value, int):
        field, mask = _integer_field(metric_type)
        return WireValue(field, _in_range(metric_type, int(value)) & mask)
    if metric_type in _REALS and isinstance(value, float | int):
        return WireValue(_REALS[metric_type], _real(metric_type, float(value)))
    if metric_type is MetricType.BOOLEAN and isinstance(value, bool):
        return WireValue(ValueField.BOOLEAN, value)
    if metric_type in _TEXTS and isinstance(value, str):
        return WireValue(ValueField.STRING, value)
    if metric_type in _BINARY and isinstance(value, bytes):
        return WireValue(ValueField.BYTES, value)
    raise PayloadError(f"{value!r:.40} is no value of the type {metric_type.label}")


def decode_value(metric_type: MetricType, value: WireValue) -> Scalar:
    """What a metric of this type holds. Arrays, files and byte strings are bytes. PayloadError if it does not fit."""
    content, field = value.content, value.field
    if metric_type in _INTEGERS and field in (ValueField.INT, ValueField.LONG):
        return _integer(metric_type, field, int(content))
    if metric_type in _REALS and isinstance(content, float):
        return _real(metric_type, content)
    if metric_type is MetricType.BOOLEAN and field is ValueField.BOOLEAN:
        return content
    if metric_type in _TEXTS and field is ValueField.STRING:
        return content
    if metric_type in _BINARY and field is ValueField.BYTES:
        return content
    raise PayloadError(f"a {field.value} is no value of the type {metric_type.label}")


def commanded_value(wanted: MetricType, given: int | None, value: WireValue) -> Scalar:
    """The value of a command for a metric of a type, where the command may say a type of its own.

    Commands should not (tck-id-payloads-metric-datatype-not-req); where one does, and says another than the birth,
    its value is converted if nothing is lost.
    """
    if given in (None, MetricType.UNKNOWN, wanted):
        return decode_value(wanted, value)
    try:
        said = MetricType(given)
    except ValueError:
        raise PayloadError(f"there is no data type {given}") from None
    content = decode_value(said, value)
    if wanted in _INTEGERS and said in _INTEGERS and isinstance(content, int):
        return _in_range(wanted, content)
    if wanted in _REALS and said in _INTEGERS and isinstance(content, int) and abs(content) <= _EXACT:
        return _real(wanted, float(content))
    if wanted in _REALS and isinstance(content, float):
        return _real(wanted, content)
    if wanted in _TEXTS and said in _TEXTS:
        return content
    raise PayloadError(f"is of the type {said.label}, where the metric is of {wanted.label}")


def _integer_field(metric_type: MetricType) -> tuple[ValueField, int]:
    wide = {**_SIGNED, **_UNSIGNED}[metric_type] == 64
    return (ValueField.LONG, MAX_UINT64) if wide else (ValueField.INT, MAX_UINT32)


def _integer(metric_type: MetricType, field: ValueField, raw: int) -> int:
    if metric_type not in _SIGNED:
        return _in_range(metric_type, raw)
    bits, width = _SIGNED[metric_type], 32 if field is ValueField.INT else 64
    extended = raw - (1 << width) if raw >> width - 1 else raw
    least, greatest = range_of(metric_type)
    if field is ValueField.INT and greatest < extended < 1 << bits:
        return extended - (1 << bits)
    if not least <= extended <= greatest:
        raise PayloadError(f"{extended} is beyond the type {metric_type.label}")
    return extended


def _in_range(metric_type: MetricType, value: int) -> int:
    least, greatest = range_of(metric_type)
    if not least <= value <= greatest:
        raise PayloadError(f"{value} is beyond the type {metric_type.label}")
    return value


def _real(metric_type: MetricType, value: float) -> float:
    if metric_type is MetricType.DOUBLE or not math.isfinite(value):
        return value
    try:
        number: float = _FLOAT.unpack(_FLOAT.pack(value))[0]
    except OverflowError:
        raise PayloadError(f"{value!r} is beyond the type {metric_type.label}") from None
    return number
