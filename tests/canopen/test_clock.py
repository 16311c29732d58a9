from __future__ import annotations

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.clock import TimeConsumer, time_of_day
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame
from tests.links.canopen_node.wire import Client


class Clock:
    """A consumer with a notebook."""

    def __init__(self) -> None:
        self.heard: list[datetime] = []
        self.service = TimeConsumer(
            on_time=lambda moment, _now: self.heard.append(moment), changed=lambda: None
        )
        self.client = Client(self.service.objects())


def test_time_of_day_counts_milliseconds_and_days_since_1984() -> None:
    assert time_of_day(bytes(6)) == datetime(1984, 1, 1, tzinfo=UTC)
    data = (43_200_000).to_bytes(4, "little") + (366).to_bytes(2, "little")
    assert time_of_day(data) == datetime(1985, 1, 1, 12, tzinfo=UTC)


def test_reserved_bits_are_not_part_of_the_time() -> None:
    assert time_of_day(b"\0\0\0\xf0\0\0") == datetime(1984, 1, 1, tzinfo=UTC)


@pytest.mark.parametrize("data", [b"", bytes(5), bytes(7), (86_400_000).to_bytes(4, "little") + bytes(2)])
def test_what_is_no_time_is_ignored(data: bytes) -> None:
    clock = Clock()
    clock.service.receive(Frame(0x100, data), 0.0)
    clock.service.receive(Frame(0x100, remote=True, length=6), 0.0)
    assert clock.heard == []


def test_a_good_time_is_handed_on() -> None:
    clock = Clock()
    clock.service.receive(Frame(0x100, bytes(6)), 0.0)
    assert clock.heard == [datetime(1984, 1, 1, tzinfo=UTC)]


def test_cob_id_can_be_moved_and_switched_off() -> None:
    clock = Clock()
    assert clock.service.cob_id == 0x100
    clock.client.write(0x1012, 0, 0x8000_0090)
    assert clock.service.cob_id == 0x90
    clock.client.write(0x1012, 0, 0x90)
    assert clock.service.cob_id is None


@pytest.mark.parametrize("value", [0x8000_0000, 0x8000_0101, 0xC000_0100, 0xA000_0100, 0x8000_0900])
def test_a_producer_and_restricted_cob_ids_are_refused(value: int) -> None:
    Clock().client.refused(0x1012, 0, value, AbortCode.INVALID_VALUE)


@given(st.binary(max_size=8))
def test_hostile_frames_do_no_harm(data: bytes) -> None:
    clock = Clock()
    clock.service.receive(Frame(0x100, data), 0.0)
    assert len(clock.heard) <= 1
