"""Number codecs: hex examples, round trips, saturation."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gatewayd.core.definition import ValueKind
from gatewayd.modbus.codec import ORDERS, TYPES, Codec, make_codec

INT = ValueKind.INT
FLOAT = ValueKind.FLOAT
BOOL = ValueKind.BOOL


@pytest.mark.parametrize(
    "type_name, order, value, registers",
    [
        ("uint16", "ABCD", 0x1234, "1234"),
        ("uint16", "CDAB", 0x1234, "1234"),
        ("uint16", "BADC", 0x1234, "3412"),
        ("uint16", "DCBA", 0x1234, "3412"),
        ("int16", "ABCD", -2, "fffe"),
        ("int16", "DCBA", -2, "feff"),
        ("int32", "ABCD", 0x12345678, "1234 5678"),
        ("int32", "CDAB", 0x12345678, "5678 1234"),
        ("int32", "BADC", 0x12345678, "3412 7856"),
        ("int32", "DCBA", 0x12345678, "7856 3412"),
        ("int32", "CDAB", -2, "fffe ffff"),
        ("uint64", "ABCD", 0x0123456789ABCDEF, "0123 4567 89ab cdef"),
        ("uint64", "CDAB", 0x0123456789ABCDEF, "cdef 89ab 4567 0123"),
        ("uint64", "BADC", 0x0123456789ABCDEF, "2301 6745 ab89 efcd"),
        ("uint64", "DCBA", 0x0123456789ABCDEF, "efcd ab89 6745 2301"),
        ("int64", "ABCD", -2, "ffff ffff ffff fffe"),
    ],
)
def test_integers_in_hex(type_name: str, order: str, value: int, registers: str) -> None:
    """Worked examples of every order."""
    codec = make_codec(type_name, order, kind=INT)
    assert codec.encode(value).hex(" ", 2) == registers
    assert codec.decode(bytes.fromhex(registers)) == value
    assert codec.words == len(registers.split())


@pytest.mark.parametrize(
    "type_name, order, value, registers",
    [
        ("float32", "ABCD", 1.0, "3f80 0000"),
        ("float32", "CDAB", 1.0, "0000 3f80"),
        ("float32", "BADC", 1.0, "803f 0000"),
        ("float32", "DCBA", 1.0, "0000 803f"),
        ("float32", "ABCD", -2.0, "c000 0000"),
        ("float64", "ABCD", 1.0, "3ff0 0000 0000 0000"),
        ("float64", "CDAB", -2.0, "0000 0000 0000 c000"),
        ("float64", "DCBA", 1.0, "0000 0000 0000 f03f"),
    ],
)
def test_reals_in_hex(type_name: str, order: str, value: float, registers: str) -> None:
    """Worked examples of IEEE 754 numbers."""
    codec = make_codec(type_name, order, kind=FLOAT)
    assert codec.encode(value).hex(" ", 2) == registers
    assert codec.decode(memoryview(bytes.fromhex(registers))) == value


every_codec = st.tuples(st.sampled_from(sorted(TYPES)), st.sampled_from(sorted(ORDERS)))
SCALES = st.sampled_from([1.0, 0.1, 0.001, 10.0, -1.0, 0.5, 1000.0])
OFFSETS = st.sampled_from([0.0, 1.0, -273.15, 100.0])


@given(every_codec, st.data())
def test_registers_survive_a_round_trip_of_plain_numbers(made: tuple[str, str], data: st.DataObject) -> None:
    """bytes -> value -> bytes is the identity for every type and order, but for NaN."""
    name, order = made
    number = TYPES[name]
    codec = make_codec(name, order, kind=FLOAT if number.is_real else INT)
    raw = data.draw(st.binary(min_size=number.size, max_size=number.size))
    if name == "bool":
        raw = bytes((raw[0] & 1, 0) if order in {"BADC", "DCBA"} else (0, raw[0] & 1))
    value = codec.decode(raw)
    assert value is not None
    assume(not math.isnan(value))
    assert codec.encode(value) == raw


@given(every_codec, SCALES, OFFSETS, st.floats(-1e4, 1e4))
def test_values_survive_a_round_trip_within_half_a_step(
    made: tuple[str, str], scale: float, offset: float, value: float
) -> None:
    """value -> bytes -> value is off by at most half a step of the register, within its range."""
    name, order = made
    number = TYPES[name]
    assume(name != "bool")
    assume(number.low + 1 <= (value - offset) / scale <= number.high - 1)
    codec = make_codec(name, order, kind=FLOAT, scale=scale, offset=offset)
    back = codec.decode(codec.encode(value))
    assert back is not None
    step = abs(scale) if not number.is_real else 1e-6 * (abs(value) + abs(offset))
    assert abs(back - value) <= step / 2 * (1 + 1e-9) + 1e-9


@given(every_codec, SCALES, OFFSETS, st.integers(-(1 << 64), 1 << 64) | st.floats() | st.booleans())
def test_encoding_never_raises(made: tuple[str, str], scale: float, offset: float, value: float) -> None:
    """Every number has registers, NaN and infinities too."""
    for kind in (INT, FLOAT) if isinstance(value, int) else (FLOAT,):
        codec = make_codec(*made, kind=kind, scale=scale, offset=offset)
        assert len(codec.encode(value)) == TYPES[made[0]].size


@given(every_codec, SCALES, OFFSETS, st.sampled_from(ValueKind), st.binary(min_size=8, max_size=8))
def test_decoding_gives_the_robots_kind(
    made: tuple[str, str], scale: float, offset: float, kind: ValueKind, raw: bytes
) -> None:
    """bool for bits, int for integers, float for doubles, or None for what an integer cannot be."""
    codec = make_codec(*made, kind=kind, scale=scale, offset=offset)
    value = codec.decode(raw[: TYPES[made[0]].size])
    if value is None:
        assert kind is INT
        assert TYPES[made[0]].is_real
    else:
        assert type(value) is (bool, int, float)[kind]


@pytest.mark.parametrize(
    "type_name, value, raw",
    [
        ("uint16", 70000, 0xFFFF),
        ("uint16", -1, 0),
        ("int16", 40000, 0x7FFF),
        ("int16", -40000, 0x8000),
        ("bool", 5, 1),
    ],
)
@pytest.mark.parametrize("kind", [INT, FLOAT])
def test_encoding_saturates(type_name: str, value: int, raw: int, kind: ValueKind) -> None:
    """A value beyond the register becomes the nearest one that fits, never a wrapped one."""
    codec = make_codec(type_name, kind=kind)
    assert codec.encode(value if kind is INT else float(value)) == raw.to_bytes(2, "big")


def test_encoding_rounds_halves_to_even() -> None:
    """0.25 and 0.35 at a scale of 0.1 are 2 and 4 (3.5 rounds up to the even number)."""
    codec = make_codec("int16", kind=FLOAT, scale=0.5)
    assert [struct.unpack(">h", codec.encode(value))[0] for value in (0.25, 0.75, -0.75, 1.25)] == [
        0,
        2,
        -2,
        2,
    ]


def test_infinities_and_nan() -> None:
    """Integers take the nearest number and 0; reals carry them; integers of the robot refuse them."""
    integer = make_codec("int16", kind=FLOAT)
    assert integer.encode(math.inf) == b"\x7f\xff"
    assert integer.encode(-math.inf) == b"\x80\x00"
    assert integer.encode(math.nan) == b"\x00\x00"
    real = make_codec("float32", kind=FLOAT)
    assert real.decode(real.encode(-math.inf)) == -math.inf
    nan = real.decode(real.encode(math.nan))
    assert nan is not None
    assert math.isnan(nan)
    assert real.encode(1e300) == bytes.fromhex("7f7fffff")
    assert make_codec("float32", kind=INT).decode(real.encode(math.nan)) is None


def test_64_bit_integers_keep_every_digit() -> None:
    """Plain integers never pass through a float."""
    codec = make_codec("uint64", kind=INT)
    value = (1 << 64) - 1
    assert codec.decode(codec.encode(value)) == value


@pytest.mark.parametrize(
    "codec, code",
    [
        (make_codec("int32", kind=INT, low=-(1 << 31), high=(1 << 31) - 1), "i"),
        (make_codec("int64", kind=INT, low=-(1 << 31), high=(1 << 31) - 1), "q"),
        (make_codec("uint16", kind=INT, low=0, high=255), "H"),
        (make_codec("float64", kind=FLOAT), "d"),
        (make_codec("int16", kind=INT, low=-(1 << 31), high=(1 << 31) - 1), None),
        (make_codec("uint32", kind=INT, low=-(1 << 31), high=(1 << 31) - 1), None),
        (make_codec("int32", kind=INT), None),
        (make_codec("float32", kind=FLOAT), None),
        (make_codec("float64", "CDAB", kind=FLOAT), None),
        (make_codec("float64", kind=FLOAT, scale=2.0), None),
        (make_codec("bool", kind=BOOL), None),
    ],
)
def test_struct_code_only_where_struct_does_the_same(codec: Codec, code: str | None) -> None:
    """Runs are merged into one struct only where no value of the robot's type needs more than packing."""
    assert codec.struct_code == code


@pytest.mark.parametrize("scale", [0.0, math.inf, math.nan])
def test_scale_that_cannot_be_undone_is_refused(scale: float) -> None:
    with pytest.raises(ValueError, match="cannot be undone"):
        make_codec("int16", kind=FLOAT, scale=scale)


def test_wrong_number_of_bytes_is_an_error() -> None:
    """The caller owns the slicing."""
    with pytest.raises(struct.error):
        make_codec("int32", kind=INT).decode(b"\x00\x00")
