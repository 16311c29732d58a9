from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.grouping import (
    GroupMember,
    ReadLimits,
    WantedItem,
    plan_classes,
    plan_poll,
)

areas = st.sampled_from(list(Area))
items = st.builds(WantedItem, areas, st.integers(0, 400), st.integers(1, 6))
limits = st.builds(
    ReadLimits,
    registers=st.integers(1, 125),
    bits=st.integers(1, 2000),
    bridge=st.integers(0, 200),
    bridge_bits=st.integers(0, 200),
    is_single=st.booleans(),
)


def span(pdu: bytes) -> tuple[int, int]:
    address, count = int.from_bytes(pdu[1:3]), int.from_bytes(pdu[3:5])
    return address, count


@given(st.lists(items, max_size=40), limits)
def test_every_item_is_read_once_and_no_request_is_too_long(
    wanted: list[WantedItem], allowed: ReadLimits
) -> None:
    groups = plan_poll(wanted, allowed)
    assert Counter(member.index for group in groups for member in group.members) == Counter(
        range(len(wanted))
    )
    for group in groups:
        read_addresses: list[int] = []
        for request in group.requests:
            address, count = span(request.pdu)
            assert 1 <= count <= allowed.size(group.area)
            read_addresses += range(address, address + count)
        assert read_addresses == list(range(group.address, group.address + group.size))
        for member in group.members:
            item = wanted[member.index]
            assert (item.area, item.size) == (group.area, member.size)
            assert item.address == group.address + member.offset
            assert 0 <= member.offset <= group.size - member.size
        if len(group.requests) > 1:
            assert max(member.size for member in group.members) > allowed.size(group.area)


@given(st.lists(items, max_size=40), limits)
def test_only_gaps_that_are_short_enough_are_read_along(
    wanted: list[WantedItem], allowed: ReadLimits
) -> None:
    for group in plan_poll(wanted, allowed):
        covered = {member.offset + place for member in group.members for place in range(member.size)}
        gap = 0
        for place in range(group.size):
            gap = 0 if place in covered else gap + 1
            assert gap <= allowed.gap(group.area)


@given(st.lists(items, min_size=1, max_size=20), st.data())
def test_each_class_has_its_own_items(wanted: list[WantedItem], data: st.DataObject) -> None:
    periods = data.draw(
        st.lists(st.sampled_from([0.02, 0.5, 10.0]), min_size=len(wanted), max_size=len(wanted))
    )
    classes = plan_classes(wanted, periods)
    assert [one.period for one in classes] == sorted(set(periods))
    for one in classes:
        found = {member.index for group in one.groups for member in group.members}
        assert found == {index for index, period in enumerate(periods) if period == one.period}


def test_neighbours_and_a_bridged_gap_are_one_request() -> None:
    wanted = [
        WantedItem(Area.HOLDING, 10, 2),
        WantedItem(Area.HOLDING, 0, 2),
        WantedItem(Area.HOLDING, 30, 1),
    ]
    first, second = plan_poll(wanted)
    assert [request.pdu.hex() for request in first.requests] == ["030000000c"]
    assert first.members == (GroupMember(1, 0, 2), GroupMember(0, 10, 2))
    assert [request.pdu.hex() for request in second.requests] == ["03001e0001"]


def test_device_that_answers_one_register_at_a_time() -> None:
    (group,) = plan_poll([WantedItem(Area.INPUT, 7, 2)], ReadLimits(is_single=True))
    assert [request.pdu.hex() for request in group.requests] == ["0400070001", "0400080001"]


@pytest.mark.parametrize("wrong", [{"registers": 126}, {"registers": 0}, {"bits": 2001}])
def test_limits_beyond_the_specification_are_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="125 registers"):
        ReadLimits(**wrong)  # type: ignore[arg-type]
