"""What locks become, by itself; what it does to values and links is in test_cell.py."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from gatewayd.core.definition import Lock, Writer
from gatewayd.core.events import Event, EventKind
from gatewayd.core.locking import Locking
from gatewayd.core.ownership import LockTable, Move
from gatewayd.core.requester import Requester
from gatewayd.core.supervision import WriterTable

PLC, HMI = range(2)
GROUP, SINGLE = range(2)
A, B, C = range(3)


class Bench:
    def __init__(self) -> None:
        self.locks = LockTable(
            [
                Lock("group", (A, B), (PLC, HMI), takeover=True),
                Lock("single", (C,), (PLC, HMI), takeover=True),
            ]
        )
        self.writers = WriterTable([Writer("plc"), Writer("hmi", timeout=1.0)], self.locks.locks)
        self.events: list[Event] = []
        self.fallen: list[int] = []
        self.adopted: set[int] = set()
        self.notified = 0
        self.locking = Locking(
            self.locks, self.writers, self.events.append, self.fall_back, self.inherited, self.notify
        )

    def fall_back(self, variables: Iterable[int], _now: float) -> None:
        self.fallen += variables

    def inherited(self, lock: int, _writer: int) -> list[int]:
        return sorted(self.adopted.intersection(self.locks.locks[lock].members))

    def notify(self) -> None:
        self.notified += 1

    def kinds(self) -> list[EventKind]:
        return [event.kind for event in self.events]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_takeover_drops_what_is_not_written_and_leaves_notifying_to_its_caller(bench: Bench) -> None:
    bench.locking.move(Requester(HMI), {GROUP: Move.ACQUIRE, SINGLE: Move.ACQUIRE}, 1.0, [(A, 1), (C, 1)])
    assert bench.fallen == []
    takeover = {GROUP: Move.TAKE_OVER, SINGLE: Move.TAKE_OVER}
    bench.locking.move(Requester(PLC), takeover, 2.0, [(B, 1), (C, 1)])
    assert (bench.fallen, bench.notified) == ([A], 0)
    assert bench.kinds() == [EventKind.ACQUIRED] * 2 + [EventKind.TAKEN_OVER] * 2


def test_taking_without_writing_drops_all_and_notifies(bench: Bench) -> None:
    bench.locking.take(Requester(HMI), GROUP, Move.ACQUIRE, 1.0)
    bench.locking.take(Requester(HMI), GROUP, Move.RENEW, 1.1)
    assert (bench.fallen, bench.notified) == ([], 0)
    bench.locking.take(Requester(PLC), GROUP, Move.TAKE_OVER, 2.0)
    assert (bench.fallen, bench.notified) == ([A, B], 1)


def test_taking_a_free_lock_drops_what_was_only_adopted(bench: Bench) -> None:
    bench.adopted = {A, B, C}
    bench.locking.move(Requester(HMI), {GROUP: Move.ACQUIRE}, 1.0, [(A, 1)])
    assert (bench.fallen, bench.notified) == ([B], 0)
    bench.locking.take(Requester(HMI), SINGLE, Move.ACQUIRE, 1.0)
    assert (bench.fallen, bench.notified) == ([B, C], 1)


def test_what_time_ends_is_released_with_its_reason(bench: Bench) -> None:
    bench.writers.connected(HMI, 0.0)
    bench.locking.move(Requester(HMI), {SINGLE: Move.ACQUIRE}, 0.0)
    bench.locking.silence(1.0)
    bench.locking.silence(1.1)
    assert [event.detail for event in bench.events[1:]] == [
        "no request for 1 s",
        "owner lost: no request for 1 s",
    ]
    assert bench.locks.owners == [None, None]


def test_only_what_the_writer_owns_is_dropped(bench: Bench) -> None:
    bench.locking.move(Requester(HMI), {SINGLE: Move.ACQUIRE}, 0.0)
    bench.locking.drop(Requester(PLC), [GROUP, SINGLE], 1.0, "it waited")
    bench.locking.drop(Requester(None), [GROUP, SINGLE], 1.0, "it waited")
    assert bench.locks.owners == [None, HMI]
    bench.locking.drop(Requester(HMI), [SINGLE, GROUP, SINGLE], 1.0, "it waited")
    assert bench.locks.owners == [None, None]
    assert bench.fallen == [C]
