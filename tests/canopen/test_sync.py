from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.sync import PRODUCER, SyncPlan, SyncService
from tests.links.canopen_node.wire import Client, Wire


class Cycle:
    """SYNC of one node, with a notebook."""

    def __init__(self, plan: SyncPlan | None = None) -> None:
        self.wire = Wire()
        self.allowed = True
        self.heard: list[int | None] = []
        self.wrong: list[int] = []
        self.announced = 0
        self.service = SyncService(
            self.wire.send,
            plan or SyncPlan(),
            allowed=lambda: self.allowed,
            on_sync=lambda counter, _now: self.heard.append(counter),
            wrong_length=lambda length, _now: self.wrong.append(length),
            changed=self._changed,
        )
        self.client = Client(self.service.objects())
        self.service.restart(0.0)

    def _changed(self) -> None:
        self.announced += 1

    def run(self, seconds: float) -> list[bytes]:
        """What is sent in this time."""
        now = 0.0
        while (now := self.service.next_deadline(now)) <= seconds:
            self.service.tick(now)
        return [frame.data for frame in self.wire.take()]


@pytest.fixture
def cycle() -> Cycle:
    return Cycle()


def test_cct_synchronization_01_sync_is_heard_in_the_allowed_states_only(cycle: Cycle) -> None:
    cycle.service.receive(Frame(0x80), 0.0)
    cycle.allowed = False
    cycle.service.receive(Frame(0x80), 1.0)
    assert (cycle.heard, cycle.service.count) == ([None], 1)


def test_cct_synchronization_02_wrong_length_is_reported_and_does_nothing(cycle: Cycle) -> None:
    cycle.service.receive(Frame(0x80, b"\1"), 0.0)
    assert (cycle.heard, cycle.wrong) == ([], [1])
    cycle.client.write(0x1019, 0, 10)
    cycle.service.receive(Frame(0x80, b"\1"), 0.0)
    cycle.service.receive(Frame(0x80), 0.0)
    assert (cycle.heard, cycle.wrong) == ([1], [1, 0])


@pytest.mark.parametrize("value", [0x0, 0x7F, 0x101, 0x5FF, 0x7FF, 0x2000_0080, 0x880])
def test_cct_synchronization_03_restricted_cob_ids_are_refused(cycle: Cycle, value: int) -> None:
    cycle.client.refused(0x1005, 0, value, AbortCode.INVALID_VALUE)


def test_cct_synchronization_04_cob_id_can_be_moved_and_is_announced(cycle: Cycle) -> None:
    cycle.client.write(0x1005, 0, 0x90)
    assert (cycle.service.cob_id, cycle.announced) == (0x90, 1)


def test_cct_synchronization_05_producer_keeps_its_cob_id(cycle: Cycle) -> None:
    cycle.client.write(0x1005, 0, PRODUCER | 0x80)
    cycle.client.refused(0x1005, 0, PRODUCER | 0x90, AbortCode.INVALID_VALUE)
    cycle.client.write(0x1005, 0, 0x90)


@pytest.mark.parametrize("value", [1, 241, 255])
def test_cct_synchronization_06_counter_overflow_values(cycle: Cycle, value: int) -> None:
    cycle.client.refused(0x1019, 0, value, AbortCode.INVALID_VALUE)
    for allowed in (2, 240, 0):
        cycle.client.write(0x1019, 0, allowed)


def test_cct_synchronization_07_counter_is_fixed_while_the_period_runs(cycle: Cycle) -> None:
    cycle.client.write(0x1006, 0, 10_000)
    cycle.client.refused(0x1019, 0, 10, AbortCode.DEVICE_STATE)
    cycle.client.write(
        0x1019, 0, 0
    )  # what is there already: a configuration that is loaded in the order of indices


def test_cct_synchronization_08_producer_starts_within_one_period_and_counts_from_1() -> None:
    cycle = Cycle(SyncPlan(producer=True, period=10_000, counter=3))
    assert cycle.run(0.055) == [b"\1", b"\2", b"\3", b"\1", b"\2"]
    assert cycle.heard == [1, 2, 3, 1, 2]
    cycle.service.stopped()
    assert cycle.run(0.065) == [b"\1"]


def test_cct_synchronization_09_producer_is_switched_by_sdo(cycle: Cycle) -> None:
    assert cycle.service.next_deadline(0.0) == math.inf
    cycle.client.write(0x1005, 0, PRODUCER | 0x80)
    assert cycle.service.next_deadline(0.0) == math.inf
    cycle.client.write(0x1006, 0, 20_000)
    cycle.service.tick(0.0)
    assert (cycle.wire.take(), cycle.service.next_deadline(0.0)) == ([Frame(0x80)], 0.02)
    cycle.client.write(0x1006, 0, 0)
    assert cycle.service.next_deadline(0.0) == math.inf


def test_cct_synchronization_10_window() -> None:
    cycle = Cycle()
    assert cycle.service.window_open(0.0)
    cycle.client.write(0x1007, 0, 5000)
    assert not cycle.service.window_open(0.0)
    cycle.service.receive(Frame(0x80), 1.0)
    assert cycle.service.window_open(1.004)
    assert not cycle.service.window_open(1.006)


def test_producer_is_silent_in_stopped_and_makes_up_for_nothing() -> None:
    cycle = Cycle(SyncPlan(producer=True, period=10_000))
    cycle.allowed = False
    cycle.service.tick(5.0)
    cycle.allowed = True
    cycle.service.tick(5.0)
    assert cycle.wire.take() == []
    assert cycle.service.next_deadline(5.0) == pytest.approx(5.01)


def test_a_cycle_that_would_flood_the_bus_is_refused(cycle: Cycle) -> None:
    cycle.client.refused(0x1006, 0, 999, AbortCode.VALUE_TOO_LOW)


@given(st.binary(max_size=8), st.booleans())
def test_hostile_frames_do_no_harm(data: bytes, remote: bool) -> None:
    cycle = Cycle()
    cycle.service.receive(Frame(0x80, data, remote), 0.0)
    assert len(cycle.heard) + len(cycle.wrong) == (0 if remote else 1)


def test_a_sync_that_does_not_go_out_is_none() -> None:
    """It is not counted, nothing is synchronous with it, and its counter value comes with the next one."""
    cycle = Cycle(SyncPlan(producer=True, period=10_000, counter=3))
    assert cycle.run(0.015) == [b"\1"]
    cycle.wire.takes = False
    cycle.run(5.0)
    assert (cycle.heard, cycle.service.count) == ([1], 1)
    cycle.wire.takes = True
    assert cycle.run(5.025) == [b"\2", b"\3"]
    assert cycle.heard == [1, 2, 3]
