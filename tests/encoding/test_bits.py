from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.encoding.bits import unpacked


@given(st.lists(st.booleans(), max_size=70))
def test_bits_come_as_they_were_packed(bits: list[bool]) -> None:
    packed = sum(bit << position for position, bit in enumerate(bits))
    assert unpacked(packed.to_bytes(10, "little"), len(bits)) == tuple(bits)
