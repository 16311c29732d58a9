from __future__ import annotations

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.grouping import PollClass, ReadLimits, WantedItem, plan_poll
from gatewayd.modbus.client.polling import AT_ONCE, NEVER, PollCycle


def cycle(*wanted: WantedItem, period: float = 1.0, limits: ReadLimits | None = None) -> PollCycle:
    return PollCycle(PollClass(period, plan_poll(wanted, limits)))


HERE, THERE = WantedItem(Area.HOLDING, 0, 1), WantedItem(Area.HOLDING, 100, 1)


def test_all_groups_are_read_and_then_it_waits_for_its_period() -> None:
    poll = cycle(HERE, THERE)
    first, part, _ = poll.take(10)
    assert poll.due == AT_ONCE
    second, _, _ = poll.take(10.1)
    assert (first.address, second.address) == (0, 100)
    assert poll.due == NEVER
    assert poll.answered(first, part, b"ab") == b"ab"
    assert poll.due == NEVER
    assert poll.failed(second)
    assert poll.due == 11
    assert poll.next_due == 11


def test_period_is_kept_though_a_beginning_was_late() -> None:
    poll = cycle(HERE)
    poll.restart(10)
    for late, due in ((0.3, 11), (0.9, 12)):
        group, part, _ = poll.take(poll.due + late)
        poll.answered(group, part, b"ab")
        assert poll.due == due


def test_what_was_missed_is_not_made_up_for() -> None:
    poll = cycle(HERE)
    poll.restart(10)
    group, part, _ = poll.take(17.5)
    poll.answered(group, part, b"ab")
    assert poll.due == 17.5


def test_long_item_is_put_together() -> None:
    poll = cycle(WantedItem(Area.HOLDING, 0, 3), limits=ReadLimits(is_single=True))
    group, first, _ = poll.take(0)
    _, second, _ = poll.take(0)
    _, third, _ = poll.take(0)
    assert poll.answered(group, second, b"cd") is None
    assert poll.answered(group, first, b"ab") is None
    assert poll.answered(group, third, b"ef") == b"abcdef"


def test_long_item_of_bits_is_put_together() -> None:
    poll = cycle(WantedItem(Area.COIL, 0, 10), limits=ReadLimits(bits=4))
    data = None
    for answer in (0b11110101, 0b1010, 0b11):  # what is beyond the 4 bits does not count
        group, part, _ = poll.take(0)
        data = poll.answered(group, part, bytes((answer,)))
    assert data == (0b11_1010_0101).to_bytes(2, "little")


def test_rest_of_a_group_is_not_read_after_a_failure() -> None:
    poll = cycle(WantedItem(Area.HOLDING, 0, 3), THERE, limits=ReadLimits(is_single=True))
    group, _, _ = poll.take(0)
    poll.take(0)
    assert poll.failed(group)
    other, _, _ = poll.take(0)
    assert other.address == 100
    assert not poll.failed(group)


def test_long_item_is_not_mixed_from_two_cycles() -> None:
    poll = cycle(WantedItem(Area.HOLDING, 0, 2), limits=ReadLimits(is_single=True))
    group, first, _ = poll.take(0)
    poll.take(0)
    poll.answered(group, first, b"old!"[:2])
    poll.failed(group)
    group, first, _ = poll.take(1)
    _, second, _ = poll.take(1)
    assert poll.answered(group, second, b"cd") is None
    assert poll.answered(group, first, b"ab") == b"abcd"
