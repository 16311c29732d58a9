from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.heartbeat import MIN_CONSUMERS, Consumer, HeartbeatConsumer, HeartbeatProducer, Watch
from gatewayd.canopen.nmt import NmtState
from tests.links.canopen_node.wire import Client, Wire, slave


class Producer:
    """A producer of node 5 whose core and NMT state the test decides on."""

    def __init__(self, milliseconds: int) -> None:
        self.wire = Wire()
        self.nmt = slave(5, NmtState.PRE_OPERATIONAL)
        self.alive = True
        self.service = HeartbeatProducer(self.wire.send, self.nmt, lambda _now: self.alive, milliseconds)
        self.client = Client(self.service.objects())
        self.service.restart(0.0)

    def run(self, start: float, end: float) -> list[float]:
        """Times at which heartbeats left, ticking exactly when asked to."""
        times = []
        while (now := max(start, self.service.next_deadline(start))) <= end:
            before = len(self.wire.frames)
            self.service.tick(now)
            times += [now] * (len(self.wire.frames) - before)
            start = now
        return times


def test_cct_heartbeat_01_first_one_period_after_boot_up() -> None:
    producer = Producer(100)
    assert producer.run(0.0, 0.35) == pytest.approx([0.1, 0.2, 0.3])


def test_cct_heartbeat_02_carries_the_nmt_state() -> None:
    producer = Producer(100)
    for state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED):
        producer.nmt.state = state
        producer.service.tick(producer.service.next_deadline(0.0))
    assert producer.wire.take() == [Frame(0x705, b"\x7f"), Frame(0x705, b"\x05"), Frame(0x705, b"\x04")]


def test_cct_heartbeat_03_writing_1017h_starts_at_once_and_0_ends() -> None:
    producer = Producer(0)
    assert producer.service.next_deadline(1.0) == math.inf
    producer.client.write(0x1017, 0, 50)
    assert producer.run(1.0, 1.12) == pytest.approx([1.0, 1.05, 1.1])
    producer.client.write(0x1017, 0, 0)
    assert producer.service.next_deadline(1.2) == math.inf


def test_no_heartbeat_while_the_core_does_not_live() -> None:
    producer = Producer(100)
    producer.alive = False
    assert producer.run(0.0, 1.05) == []
    producer.alive = True
    assert len(producer.run(1.05, 1.25)) == 2


def test_missed_heartbeats_are_not_made_up_for() -> None:
    producer = Producer(10)
    producer.service.tick(5.0)
    producer.service.tick(5.0)
    assert len(producer.wire.take()) == 1
    assert producer.service.next_deadline(5.0) == pytest.approx(5.01)


class Watcher:
    """A consumer with a notebook."""

    def __init__(self, *consumers: Consumer) -> None:
        self.calls: list[tuple[str, int]] = []
        self.announced = 0
        self.service = HeartbeatConsumer(
            consumers,
            lost=lambda node, _now: self.calls.append(("lost", node)),
            back=lambda node, _now: self.calls.append(("back", node)),
            changed=self._changed,
        )
        self.client = Client(self.service.objects())

    def _changed(self) -> None:
        self.announced += 1

    def hear(self, node: int, now: float, state: int = 5) -> None:
        self.service.receive(Frame(0x700 + node, bytes([state])), now)


MASTER = Consumer(1, 500, None)


def test_cct_heartbeat_04_supervision_starts_with_the_first_heartbeat() -> None:
    watcher = Watcher(MASTER)
    watcher.service.tick(100.0)
    assert (watcher.calls, watcher.service.next_deadline(100.0)) == ([], math.inf)
    watcher.hear(1, 100.0)
    assert watcher.service.next_deadline(100.0) == 100.5


def test_cct_heartbeat_05_silence_is_reported_once() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(0.49)
    assert watcher.calls == []
    watcher.service.tick(0.5)
    watcher.service.tick(9.0)
    assert watcher.calls == [("lost", 1)]


def test_cct_heartbeat_06_return_is_reported_once() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(1.0)
    watcher.hear(1, 2.0)
    watcher.hear(1, 2.1)
    assert watcher.calls == [("lost", 1), ("back", 1)]


def test_boot_up_of_a_watched_node_ends_its_supervision_until_it_is_heard() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.hear(1, 0.1, state=0)
    watcher.service.tick(9.0)
    assert watcher.calls == []
    assert watcher.service.state(1) is Watch.WAITING


def test_boot_up_of_a_lost_node_is_not_its_return() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(1.0)
    watcher.hear(1, 2.0, state=0)
    assert watcher.calls == [("lost", 1)]
    watcher.hear(1, 2.1)
    assert watcher.calls == [("lost", 1), ("back", 1)]


def test_another_consumer_goes_on_with_what_is_lost() -> None:
    former, successor = Watcher(MASTER), Watcher(MASTER)
    former.hear(1, 0.0)
    former.service.tick(0.5)
    successor.service.restart(0.5)
    successor.service.resume(former.service)
    assert successor.service.state(1) is Watch.LOST


def test_after_a_gap_of_our_own_a_node_has_its_whole_time_again() -> None:
    watcher = Watcher(MASTER, Consumer(2, 500, None))
    watcher.hear(1, 0.0)
    watcher.service.gap(0.1, 9.0)
    watcher.service.tick(9.49)
    assert (watcher.calls, watcher.service.state(2)) == ([], Watch.WAITING)
    watcher.service.tick(9.5)
    watcher.service.gap(10.0, 20.0)
    assert (watcher.calls, watcher.service.state(1)) == ([("lost", 1)], Watch.LOST)


def test_a_process_that_stands_still_over_and_over_misses_a_silent_node_all_the_same() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    now = 0.0
    while not watcher.calls:
        watcher.service.gap(now, now + 0.1)
        now += 0.2
        watcher.service.tick(now)
        assert now < 2.0
    assert now > 0.8


def test_cct_heartbeat_07_one_node_twice_is_refused() -> None:
    watcher = Watcher(MASTER)
    watcher.client.refused(0x1016, 2, 1 << 16 | 100, AbortCode.PARAMETER_INCOMPATIBLE)
    watcher.client.write(0x1016, 2, 1 << 16)
    watcher.client.write(0x1016, 1, 1 << 16 | 200)


@pytest.mark.parametrize("value", [128 << 16 | 100, 255 << 16 | 100, 1 << 24 | 1 << 16 | 100])
def test_entries_of_1016h_name_a_node_and_nothing_else(value: int) -> None:
    Watcher().client.refused(0x1016, 1, value, AbortCode.INVALID_VALUE)


def test_1016h_has_eight_entries_or_as_many_as_needed() -> None:
    assert Watcher().client.read(0x1016) == MIN_CONSUMERS
    assert Watcher(*(Consumer(node, 100, None) for node in range(1, 13))).client.read(0x1016) == 12


def test_a_written_entry_is_watched_from_the_next_tick_on_and_announced() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.client.write(0x1016, 2, 2 << 16 | 100)
    assert watcher.service.next_deadline(0.0) == -math.inf
    watcher.service.tick(0.1)
    assert (set(watcher.service.nodes), watcher.announced) == ({1, 2}, 1)
    assert watcher.service.state(1) is Watch.ALIVE


def test_a_lost_node_that_is_no_longer_watched_is_no_error_any_more() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(1.0)
    watcher.client.write(0x1016, 1, 0)
    watcher.service.tick(1.1)
    assert watcher.calls == [("lost", 1), ("back", 1)]


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans())))
def test_hostile_frames_do_no_harm(frames: list[tuple[int, bytes, bool]]) -> None:
    watcher = Watcher(MASTER, Consumer(2, 100, None))
    for now, (can_id, data, remote) in enumerate(frames):
        watcher.service.receive(Frame(can_id, b"" if remote else data, remote), float(now))
        watcher.service.tick(float(now))
    assert watcher.service.nodes == {1, 2}


@pytest.mark.parametrize(
    "before, after, due",
    [(100, 100, 10.1), (100, 200, 10.1), (0, 100, -math.inf), (100, 0, math.inf)],
)
def test_another_producer_goes_on_at_its_own_time(before: int, after: int, due: float) -> None:
    """At once where there was none, never where there is none any more."""
    former, successor = Producer(before), Producer(after)
    former.service.restart(10.0)
    successor.service.resume(former.service)
    assert successor.service.next_deadline(10.0) == pytest.approx(due)
