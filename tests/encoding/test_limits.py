"""A declared limit is reachable in every encoding: the nearest raw number means it, and decodes to exactly it."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gatewayd.core.definition import ValueKind
from gatewayd.encoding.limits import ends_of, read_limits
from gatewayd.modbus.codec import TYPES, NumberFormat, make_codec

INT, FLOAT, BOOL = ValueKind.INT, ValueKind.FLOAT, ValueKind.BOOL
CENTS = [n / 100 for n in range(1, 1001)]
TENTHS = [n / 10 for n in range(1, 1001)]


@pytest.mark.parametrize(
    "type_name, scale, limits", [("float32", 1.0, CENTS), ("int16", 0.1, TENTHS)], ids=["float32", "int16"]
)
def test_every_decimal_limit_is_reached(type_name: str, scale: float, limits: list[float]) -> None:
    """As declared limits 478 of the first thousand and 352 of the second were refused to a PLC that wrote them."""
    plain = make_codec(type_name, kind=FLOAT, scale=scale)
    refused = 0
    for limit in limits:
        codec = make_codec(type_name, kind=FLOAT, scale=scale, limits=(-limit, limit))
        assert codec.decode(codec.encode(limit)) == limit
        assert codec.decode(codec.encode(-limit)) == -limit
        decoded = plain.decode(plain.encode(limit))
        assert decoded is not None
        refused += decoded > limit
    assert refused == (478 if type_name == "float32" else 352)


NUMBERS = st.sampled_from([number for number in TYPES.values() if number.name != "bool"])
DECIMALS = st.integers(-(10**6), 10**6).flatmap(lambda n: st.integers(0, 5).map(lambda d: n / 10**d))
LIMITS = st.tuples(DECIMALS, DECIMALS).map(lambda pair: (min(pair), max(pair)))
SCALES = st.sampled_from([1.0, 0.1, 0.01, 0.001, 0.5, 10.0, -0.1, 0.0625, 1 / 3])
OFFSETS = st.sampled_from([0.0, -273.15, 1.0, 100.0, 0.05])


@given(NUMBERS, SCALES, OFFSETS, LIMITS)
def test_the_nearest_raw_number_is_the_limit(
    number: NumberFormat, scale: float, offset: float, limits: tuple[float, float]
) -> None:
    """Whatever scale and offset: encoding a limit and decoding it gives exactly that."""
    low, high = limits
    for limit in (low, high):
        raw = (limit - offset) / scale
        assume(number.low <= raw <= number.high)
        if not number.is_real:  # an integer that means 0 is never another limit
            assume(limit == 0 or abs(round(raw) * scale + offset) > 1e-6)
    codec = make_codec(number.name, kind=FLOAT, scale=scale, offset=offset, limits=(low, high))
    assume(number.is_real or codec.encode(low) != codec.encode(high))
    assert codec.decode(codec.encode(low)) == low
    assert codec.decode(codec.encode(high)) == high


@given(NUMBERS, SCALES, OFFSETS, LIMITS, st.binary(min_size=8, max_size=8))
def test_other_raw_numbers_mean_what_they_meant(
    number: NumberFormat, scale: float, offset: float, limits: tuple[float, float], data: bytes
) -> None:
    """Only limits are touched, by at most half a step; what lies beyond stays beyond, and is refused."""
    codec = make_codec(number.name, kind=FLOAT, scale=scale, offset=offset, limits=limits)
    plain = make_codec(number.name, kind=FLOAT, scale=scale, offset=offset)
    raw = data[: number.size]
    value, before = codec.decode(raw), plain.decode(raw)
    assert value is not None
    assert before is not None
    if value != before and not math.isnan(before):
        assert value in limits
        step = abs(scale) if not number.is_real else 2e-7 * (abs(value) + abs(offset)) + 1e-9
        assert abs(value - before) <= step / 2 * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize("step", [-1, 1])
def test_the_neighbour_of_a_limit_is_itself(step: int) -> None:
    """One float32 further is beyond the limit, and one before it is what it was."""
    codec = make_codec("float32", kind=FLOAT, limits=(-0.05, 0.05))
    raw = int.from_bytes(codec.encode(0.05), "big") + step
    data = raw.to_bytes(4, "big")
    assert codec.decode(data) == struct.unpack(">f", data)[0]
    assert codec.decode(bytes.fromhex("7fc00000")) != 0.05
    assert codec.decode(bytes.fromhex("7f800000")) == math.inf


@pytest.mark.parametrize(
    "type_name, scale, limits, raw, value",
    [
        ("int16", 0.1, (0.0, 1.04), 10, 1.04),
        ("int16", 0.1, (0.0, 1.06), 11, 1.06),
        ("int16", -0.1, (0.0, 0.3), -3, 0.3),
        ("int16", 0.1, (-0.3, 0.3), -3, -0.3),
        ("uint16", 1.0, (0.4, 10.0), 0, 0.0),
        ("uint16", 1.0, (0.4, 0.45), 0, 0.0),
        ("int16", 1.0, (0.9, 1.2), 1, 0.9),
        ("int16", 0.1, (0.0, 5000.0), 32767, 3276.7000000000003),
    ],
)
def test_limits_between_two_steps(
    type_name: str, scale: float, limits: tuple[float, float], raw: int, value: float
) -> None:
    """The nearest step means the limit; 0 means 0; what a type cannot express is no limit of it."""
    codec = make_codec(type_name, kind=FLOAT, scale=scale, limits=limits)
    assert codec.decode(raw.to_bytes(2, "big", signed=raw < 0)) == value


def test_whole_numbers_keep_every_digit() -> None:
    """No limit of an integer in an integer needs care, however long it is."""
    limits = (0, (1 << 60) + 1)
    codec = make_codec("uint64", kind=INT, low=0, high=(1 << 64) - 1, limits=limits)
    assert codec.ends == (None, None)
    for value in (1 << 60, (1 << 60) + 1, (1 << 60) + 2):
        assert codec.decode(codec.encode(value)) == value


def test_the_end_of_an_integer_in_a_real() -> None:
    """The float32 nearest to the greatest INT32 is one more: it means the greatest."""
    codec = make_codec("float32", kind=INT, low=-(2**31), high=2**31 - 1)
    assert codec.decode(codec.encode(2**31 - 1)) == 2**31 - 1
    assert codec.decode(codec.encode(-(2**31))) == -(2**31)


def test_whole_limits_in_steps_of_ten() -> None:
    """What a variable of whole numbers takes ends at a whole number."""
    codec = make_codec("int16", kind=INT, scale=10, low=-(2**31), high=2**31 - 1, limits=(0, 99.5))
    assert codec.decode((10).to_bytes(2, "big")) == 99
    assert type(codec.decode((10).to_bytes(2, "big"))) is int


def test_ends() -> None:
    """Of limits and type the narrower; bits have none."""
    assert ends_of(INT, (0.5, 99.5), 0, 255) == (1, 99)
    assert ends_of(INT, None, 0, 255) == (0, 255)
    assert ends_of(FLOAT, (0.5, 99.5), None, None) == (0.5, 99.5)
    assert ends_of(BOOL, (0, 1), None, None) == (None, None)


def test_nothing_to_prepare() -> None:
    """Limits that decode to themselves cost nothing."""
    assert read_limits((-1.0, 0.5), "f", lambda raw: raw) is None
    assert read_limits((None, None), "h", lambda raw: raw) is None
    assert read_limits((None, 1e300), "f", lambda raw: raw) is None
    assert read_limits((None, 1e300), "h", lambda raw: raw * 1e-300, 1e-300) is None
