from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.modbus_server.readable import Readable
from gatewayd.modbus.areas import MAX_READ_BITS, MAX_READ_REGISTERS


@given(
    st.sets(st.integers(0, 65535) | st.integers(0, 300), max_size=300),
    st.lists(st.sets(st.integers(0, 300), max_size=50), min_size=1, max_size=3),
    st.sampled_from([MAX_READ_REGISTERS, MAX_READ_BITS]),
)
def test_reach_is_the_number_of_readable_addresses_in_a_row(
    mapped: set[int], ever_held_back: list[set[int]], longest: int
) -> None:
    """Whatever was held back before."""
    readable = Readable(mapped, longest)
    held_back: set[int] = set()
    for held_back in ever_held_back:
        readable.hold_back(frozenset(held_back))
    for address in {*mapped, *(address + 1 for address in mapped), 0, 65535} - {65536}:
        for reach, there in ((readable.mapped, mapped), (readable.reach, mapped - held_back)):
            length = 0
            while address + length in there and length < longest:
                length += 1
            assert reach[address] == length


def test_holding_back_happens_in_place() -> None:
    """Connections keep a reference to the table."""
    readable = Readable(range(10), MAX_READ_REGISTERS)
    reach = readable.reach
    readable.hold_back(frozenset({5}))
    assert (reach[0], reach[5], reach[6]) == (5, 0, 4)
    readable.hold_back(frozenset())
    assert reach[0] == 10


@pytest.mark.parametrize("longest", [MAX_READ_REGISTERS, MAX_READ_BITS])
def test_a_long_stretch_is_held_back_in_its_middle(longest: int) -> None:
    readable = Readable(range(60_000), longest)
    readable.hold_back(frozenset({30_000, 30_001, 30_005}))
    reach = readable.reach
    assert (reach[30_000 - longest], reach[30_001 - longest]) == (longest, longest - 1)
    assert (reach[29_999], reach[30_000], reach[30_001], reach[30_002], reach[30_006]) == (
        1,
        0,
        0,
        3,
        longest,
    )
    readable.hold_back(frozenset({30_005}))
    assert (reach[30_000], reach[30_004], reach[30_005]) == (5, 1, 0)
    readable.hold_back(frozenset())
    assert readable.reach == readable.mapped
