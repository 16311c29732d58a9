"""However much is done, few records leave, and each thing that was done is in one of them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from gatewayd.audit.merging import ALARM, ALL, EACH, EACH_PERIOD, OF_WRITER, WAITING, AuditMerging
from gatewayd.audit.record import Record
from gatewayd.report.event_text import ACCEPTED, EventRecord

WALL = 1_800_000_000.0


@pytest.fixture
def kept() -> list[Record]:
    return []


@pytest.fixture
def merging(kept: list[Record]) -> AuditMerging:
    return AuditMerging(kept.append)


def record(now: float, variable: str = "start", writer: str = "plc", **fields: object) -> Record:
    event = EventRecord(ACCEPTED, writer, variable, old=int(now * 1000), new=int(now * 1000) + 1)
    return Record(WALL + now, now, "press", replace(event, **fields))  # type: ignore[arg-type]


def test_the_same_is_kept_some_times_then_merged_with_its_number(
    merging: AuditMerging, kept: list[Record]
) -> None:
    for step in range(1000):
        merging.add(record(step / 1000))
    assert len(kept) == EACH
    merging.tick(EACH_PERIOD + 1)
    last = kept[-1]
    assert (len(kept), last.event.times, last.monotonic) == (EACH + 1, 1000 - EACH, 0.999)
    assert (last.event.old, last.event.new) == (EACH, 1000)


def test_what_differs_in_who_what_or_from_where_is_not_merged(
    merging: AuditMerging, kept: list[Record]
) -> None:
    for _ in range(EACH + 1):
        merging.add(record(0.0))
    for other in (
        record(0.0, variable="limit"),
        record(0.0, writer="hmi"),
        record(0.0, reason="held by another owner"),
        record(0.0, peer="192.0.2.30:50000"),
        record(0.0, peer="192.0.2.31:50000"),
        replace(record(0.0), cell="weld"),
    ):
        before = len(kept)
        merging.add(other)
        assert kept[before:] == [other]


def test_one_writer_that_does_much_leaves_little_and_is_told(
    merging: AuditMerging, kept: list[Record]
) -> None:
    for step in range(60_000):
        merging.add(record(step / 1000, f"v{step % 500}", detail="x"))
        if not step % 200:
            merging.tick(step / 1000)
    assert len(kept) <= OF_WRITER + 10 * 60 + 1
    assert merging.flooded(60.0) == [("press", "plc")]
    merging.add(record(60.0, "door", "hmi"))
    assert kept[-1].event.writer == "hmi", "others are not concerned"
    merging.tick(math.inf)
    assert sum(one.event.times for one in kept) == 60_001
    assert merging.flooded(60.0 + ALARM) == []


def test_what_waits_is_bounded_and_the_rest_counted(merging: AuditMerging, kept: list[Record]) -> None:
    for number in range(10_000):
        merging.add(record(0.0, f"v{number}"))
    merging.tick(math.inf)
    assert len(kept) == OF_WRITER + WAITING + 1
    assert sum(one.event.times for one in kept) == 10_000
    assert kept[-1].event.text() == (
        f"write accepted ({10_000 - OF_WRITER - WAITING} changes, further ones of plc, only counted)"
    )


def test_many_writers_together_are_bounded_too(merging: AuditMerging, kept: list[Record]) -> None:
    for number in range(50_000):
        merging.add(record(0.0, f"v{number % 900}", f"w{number % 64}"))
    assert len(kept) <= ALL


def test_what_was_written_stands_before_what_became_of_it(merging: AuditMerging, kept: list[Record]) -> None:
    for step in range(EACH + 3):
        merging.add(record(step / 1000))
    merging.add(record(1.0, writer="gateway", what="fallback applied"))
    assert [(one.event.what, one.event.times) for one in kept[EACH:]] == [
        (ACCEPTED, 3),
        ("fallback applied", 1),
    ]
