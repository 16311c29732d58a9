from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.heartbeat import LEAST_CONSUMERS, HeartbeatConsumer, HeartbeatProducer, Watch
from gatewayd.canopen.nmt import NmtState
from gatewayd.canopen.plan import Consumer
from tests.canopen.wire import Client, Wire


class Producer:
    """A producer of node 5 whose core and NMT state the test decides on."""

    def __init__(self, milliseconds: int) -> None:
        self.wire = Wire()
        self.state = NmtState.PRE_OPERATIONAL
        self.alive = True
        self.service = HeartbeatProducer(
            self.wire.send, lambda: 5, lambda: self.state, lambda _now: self.alive, milliseconds
        )
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


def test_cct_heartbeat_02_tells_the_nmt_state() -> None:
    producer = Producer(100)
    for state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED):
        producer.state = state
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
    assert producer.service.withheld == 10
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
        self.told: list[tuple[str, int]] = []
        self.announced = 0
        self.service = HeartbeatConsumer(
            consumers,
            lost=lambda node, _now: self.told.append(("lost", node)),
            back=lambda node, _now: self.told.append(("back", node)),
            booted=lambda node, _now: self.told.append(("booted", node)),
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
    assert (watcher.told, watcher.service.next_deadline(100.0)) == ([], math.inf)
    watcher.hear(1, 100.0)
    assert watcher.service.next_deadline(100.0) == 100.5


def test_cct_heartbeat_05_silence_is_told_once() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(0.49)
    assert watcher.told == []
    watcher.service.tick(0.5)
    watcher.service.tick(9.0)
    assert watcher.told == [("lost", 1)]


def test_cct_heartbeat_06_return_is_told_once() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(1.0)
    watcher.hear(1, 2.0)
    watcher.hear(1, 2.1)
    assert watcher.told == [("lost", 1), ("back", 1)]


def test_boot_up_of_a_watched_node_ends_its_supervision_until_it_is_heard() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.hear(1, 0.1, state=0)
    watcher.service.tick(9.0)
    assert watcher.told == [("booted", 1)]
    assert watcher.service.state(1) is Watch.WAITING


def test_boot_up_of_a_lost_node_is_not_its_return() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0)
    watcher.service.tick(1.0)
    watcher.hear(1, 2.0, state=0)
    assert watcher.told == [("lost", 1)]
    watcher.hear(1, 2.1)
    assert watcher.told == [("lost", 1), ("back", 1)]


def test_a_node_that_owes_its_first_heartbeat_has_one_heartbeat_time() -> None:
    watcher = Watcher(MASTER)
    assert watcher.service.expect(1, 100.0)
    assert watcher.service.next_deadline(100.0) == 100.5
    watcher.service.tick(100.49)
    assert watcher.told == []
    watcher.service.tick(100.5)
    assert (watcher.told, watcher.service.state(1)) == ([("lost", 1)], Watch.LOST)
    assert not watcher.service.expect(1, 100.6)
    watcher.hear(1, 101.0)
    assert watcher.told == [("lost", 1), ("back", 1)]
    assert watcher.service.expect(1, 101.1)
    assert watcher.service.next_deadline(101.1) == 101.5, "a heartbeat alone prolongs it"


def test_further_signs_of_life_are_no_heartbeat() -> None:
    watcher = Watcher(MASTER)
    for now in (0.0, 0.2, 0.4):
        assert watcher.service.expect(1, now)
    watcher.service.tick(0.5)
    assert watcher.told == [("lost", 1)]


def test_a_heartbeat_in_time_is_all_that_was_owed() -> None:
    watcher = Watcher(MASTER)
    watcher.service.expect(1, 0.0)
    watcher.hear(1, 0.4)
    watcher.service.tick(0.89)
    assert (watcher.told, watcher.service.state(1)) == ([], Watch.ALIVE)


def test_a_node_that_boots_owes_its_heartbeat_from_its_next_sign_on() -> None:
    watcher = Watcher(MASTER)
    watcher.hear(1, 0.0, state=0)
    assert watcher.told == [], "it had shown nothing of itself"
    watcher.service.expect(1, 0.0)
    watcher.hear(1, 0.4, state=0)
    assert (watcher.told, watcher.service.next_deadline(0.4)) == ([("booted", 1)], math.inf)
    watcher.service.expect(1, 1.0)
    assert watcher.service.next_deadline(1.0) == 1.5


def test_a_lost_node_that_boots_is_not_believed_before_it_is_heard() -> None:
    watcher = Watcher(MASTER)
    watcher.service.expect(1, 0.0)
    watcher.service.tick(0.5)
    watcher.hear(1, 0.6, state=0)
    assert not watcher.service.expect(1, 0.7)
    assert watcher.told == [("lost", 1)]


def test_a_node_that_is_not_watched_owes_nothing() -> None:
    watcher = Watcher(MASTER)
    assert watcher.service.expect(2, 0.0)
    assert watcher.service.next_deadline(0.0) == math.inf


def test_what_is_owed_is_owed_under_a_new_time_and_after_a_restart_no_more() -> None:
    watcher = Watcher(MASTER)
    watcher.service.expect(1, 0.0)
    watcher.client.write(0x1016, 1, 1 << 16 | 200)
    watcher.service.tick(0.1)
    assert watcher.service.next_deadline(0.1) == pytest.approx(0.3)
    watcher.service.restart(0.2)
    assert watcher.service.next_deadline(0.2) == math.inf
    watcher.service.tick(9.0)
    assert watcher.told == []


def test_another_consumer_goes_on_with_what_is_owed_and_what_is_lost() -> None:
    for lost in (False, True):
        former, next_one = Watcher(MASTER), Watcher(MASTER)
        former.service.expect(1, 0.0)
        former.service.tick(0.5 if lost else 0.1)
        next_one.service.restart(0.5)
        next_one.service.resume(former.service)
        assert next_one.service.expect(1, 0.4) is not lost
        assert next_one.service.next_deadline(0.4) == (math.inf if lost else 0.5)


def test_cct_heartbeat_07_one_node_twice_is_refused() -> None:
    watcher = Watcher(MASTER)
    watcher.client.refused(0x1016, 2, 1 << 16 | 100, AbortCode.PARAMETER_INCOMPATIBLE)
    watcher.client.write(0x1016, 2, 1 << 16)
    watcher.client.write(0x1016, 1, 1 << 16 | 200)


@pytest.mark.parametrize("value", [128 << 16 | 100, 255 << 16 | 100, 1 << 24 | 1 << 16 | 100])
def test_entries_of_1016h_name_a_node_and_nothing_else(value: int) -> None:
    Watcher().client.refused(0x1016, 1, value, AbortCode.INVALID_VALUE)


def test_1016h_has_eight_entries_or_as_many_as_needed() -> None:
    assert Watcher().client.read(0x1016) == LEAST_CONSUMERS
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
    assert watcher.told == [("lost", 1), ("back", 1)]


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans())))
def test_hostile_frames_do_no_harm(frames: list[tuple[int, bytes, bool]]) -> None:
    watcher = Watcher(MASTER, Consumer(2, 100, None))
    for now, (can_id, data, remote) in enumerate(frames):
        watcher.service.receive(Frame(can_id, b"" if remote else data, remote), float(now))
        watcher.service.tick(float(now))
    assert watcher.service.nodes == {1, 2}
