from __future__ import annotations

import math
import struct

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Value, ValueKind
from gatewayd.modbus.block import BitWord, Block
from gatewayd.modbus.codec import ORDERS, TYPES, Codec, make_codec

LOW, HIGH = -(2.0**31), 2.0**31 - 1

whole_types = st.sampled_from([name for name, number in TYPES.items() if not number.is_byte])
linears = st.sampled_from([(1e300, 0.0), (1.0, 0.0), (1.0, 0.0), (0.1, 0.0), (-0.5, 3.0), (1.0, 1e-9)])
limits = st.sampled_from([None, None, (-0.05, 0.05), (-100.0, 100.0), (0.3, 12.7)])


@st.composite
def codecs(draw: st.DrawFn) -> Codec:
    scale, offset = draw(linears)
    kind = draw(st.sampled_from(ValueKind))
    low, high = (LOW, HIGH) if kind is ValueKind.INT else (None, None)
    return make_codec(
        draw(whole_types),
        draw(st.sampled_from(tuple(ORDERS))),
        kind=kind,
        scale=scale,
        offset=offset,
        low=low,
        high=high,
        limits=None if kind is ValueKind.BOOL else draw(limits),
    )


@st.composite
def requests(draw: st.DrawFn) -> tuple[list[tuple[int, Codec]], bytes]:
    """Numbers with gaps between them, and bytes: any, or what values near the limits become."""
    numbers: list[tuple[int, Codec]] = []
    data = b""
    for codec in draw(st.lists(codecs(), max_size=6)):
        data += draw(st.binary(max_size=4).map(lambda gap: gap[: len(gap) & ~1]))
        numbers.append((len(data) // 2, codec))
        near = draw(st.sampled_from([0.0, 0.05, -0.05, 100.0, 3.0, -7.0, 12.7, 0.3, 1e6, math.inf, math.nan]))
        if codec.kind is not ValueKind.FLOAT:
            near = int(near) if math.isfinite(near) else 0
        size = 2 * codec.words
        data += draw(st.one_of(st.binary(min_size=size, max_size=size), st.just(codec.encode(near))))
    return numbers, data


def same(value: Value, other: Value | None) -> bool:
    """Also in kind and sign; NaN is itself."""
    if type(value) is not type(other):
        return False
    return struct.pack(">d", value) == struct.pack(">d", other)


@given(requests())
def test_numbers_are_what_their_codecs_make_of_them(request: tuple[list[tuple[int, Codec]], bytes]) -> None:
    numbers, data = request
    block = Block(numbers)
    values = block.decode(data)
    each = [codec.decode(data[2 * word : 2 * (word + codec.words)]) for word, codec in numbers]
    if values is None:
        assert None in each
        return
    assert sorted(block.order) == list(range(len(numbers)))
    for value, index, (low, high) in zip(values, block.order, block.bounds, strict=True):
        if low <= value <= high:
            assert same(value, each[index])
        else:
            # Only at and beyond the limits, or with NaN, may it ask for care.
            assert numbers[index][1].window != (-math.inf, math.inf) or value != value  # noqa: PLR0124


def test_between_its_limits_a_request_needs_no_care() -> None:
    real = make_codec("float32", kind=ValueKind.FLOAT, limits=(-0.05, 0.05))
    scaled = make_codec("int16", kind=ValueKind.FLOAT, scale=0.1, limits=(-100.0, 100.0))
    whole = make_codec("int32", "CDAB", kind=ValueKind.INT, low=LOW, high=HIGH)
    block = Block([(0, real), (2, scaled), (4, whole)])
    assert block.decode(bytes.fromhex("3d000000 0064 0000 0001 0002")) == [0.03125, 10.0, 0x20001]
    (least, greatest), *_others = block.bounds  # they are compared by who has limits, too
    assert least < 0.03125 < greatest
    values = block.decode(real.encode(0.05) + bytes(8))
    assert values is not None
    assert values[0] > greatest


@given(
    st.integers(0, 0xFFFF),
    st.permutations(range(16)).flatmap(lambda bits: st.integers(1, 16).map(lambda n: bits[:n])),
)
def test_bits_come_in_the_order_asked_for(word: int, bits: list[int]) -> None:
    wanted = BitWord(1, tuple(bits))
    assert Block([], [wanted]).decode(b"\xff\xff" + word.to_bytes(2, "big")) == [
        bool(word >> bit & 1) for bit in bits
    ]


def test_a_bit_that_may_not_be_set_needs_care() -> None:
    block = Block([], [BitWord(0, (0, 1), others=0xFFFC)])
    assert block.decode(b"\x00\x02") == [False, True]
    assert block.decode(b"\x00\x06") is None
