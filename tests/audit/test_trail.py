"""Who wrote what and when: what becomes a record, what is merged, and what it costs."""

from __future__ import annotations

import asyncio
import json
import math
from collections import Counter
from itertools import pairwise

import pytest

from gatewayd.audit.record import Record
from gatewayd.audit.trail import MERGED, Audit
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.core.requester import Requester
from gatewayd.report.event_text import ACCEPTED, EventRecord

NUMBER, REAL = 0, 1
PLC, HMI = 0, 1
WALL = 1_800_000_000.0


def definition() -> CellDefinition:
    fields = ("input_int_register_0", "input_double_register_0")
    kinds = (ValueKind.INT, ValueKind.FLOAT)
    return CellDefinition(
        name="press",
        fingerprint=1,
        variables=tuple(
            Variable(n + 1, ("number", "real")[n], Direction.INPUT, kinds[n], fields[n], lock=n)
            for n in (0, 1)
        ),
        locks=tuple(Lock(("number", "real")[n], (n,), (PLC, HMI), takeover=True) for n in (0, 1)),
        writers=(Writer("plc"), Writer("hmi")),
        stale_after=1.0,
    )


@pytest.fixture
def cell() -> Cell:
    cell = Cell(definition())
    cell.robot_connected(0.0)
    cell.adopt({NUMBER: 0, REAL: 0.0}, 0.0)
    return cell


@pytest.fixture
def lines() -> list[str]:
    return []


@pytest.fixture
def audit(cell: Cell, lines: list[str]) -> Audit:
    audit = Audit(lines.append, wall_clock=lambda: WALL)
    audit.watch(cell)
    return audit


def happened(audit: Audit) -> list[EventRecord]:
    return [record.event for record in audit]


def written(audit: Audit) -> list[tuple[str | None, object, object, int]]:
    return [(one.writer, one.old, one.new, one.times) for one in happened(audit) if one.what == ACCEPTED]


def test_a_change_is_recorded_at_once(cell: Cell, audit: Audit, lines: list[str]) -> None:
    assert cell.write(Requester(PLC), [Change(NUMBER, 7)], 1.5) is None
    assert json.loads(lines[-1]) == {
        "time": "2027-01-15T08:00:00.000Z",
        "monotonic": 1.5,
        "cell": "press",
        "what": "write accepted",
        "writer": "plc",
        "variable": "number",
        "old": 0,
        "new": 7,
    }
    assert len(list(audit)) == len(lines) == 2
    assert [one.what for one in happened(audit)] == ["lock acquired", "write accepted"]


def test_a_rewrite_of_the_same_value_is_no_record(cell: Cell, audit: Audit) -> None:
    for turn in range(50):
        assert cell.write(Requester(PLC), [Change(NUMBER, 7)], 1 + turn / 10) is None
        audit.tick(1 + turn / 10)
    assert written(audit) == [("plc", 0, 7, 1)]


def test_a_value_that_keeps_changing_is_told_once_a_second(cell: Cell, audit: Audit) -> None:
    for turn in range(1, 301):
        now = 1 + turn / 100
        audit.tick(now)
        assert cell.write(Requester(PLC), [Change(NUMBER, turn)], now) is None
    audit.tick(100.0)
    told = written(audit)
    assert told[0] == ("plc", 0, 1, 1)
    assert sum(times for *_, times in told) == 300
    assert len(told) <= 5
    assert all(before[2] == after[1] for before, after in pairwise(told))
    assert told[-1][2] == 300


def test_another_writer_ends_what_was_merged(cell: Cell, audit: Audit) -> None:
    for writer, value in ((HMI, 1), (HMI, 2), (PLC, 3)):
        assert cell.write(Requester(writer), [Change(NUMBER, value)], 1.0) is None
    assert written(audit) == [("hmi", 0, 1, 1), ("hmi", 1, 2, 1), ("plc", 2, 3, 1)]


def test_the_time_of_merged_changes_is_that_of_the_last(cell: Cell, audit: Audit) -> None:
    for now, value in ((1.0, 1), (1.2, 2), (1.4, 3)):
        assert cell.write(Requester(PLC), [Change(NUMBER, value)], now) is None
    audit.tick(1.0 + MERGED)
    last = list(audit)[-1]
    assert (last.monotonic, last.event.times) == (1.4, 2)
    assert last.wall == pytest.approx(WALL - (MERGED - 0.4))


def test_a_refusal_names_reason_and_holder(cell: Cell, audit: Audit) -> None:
    assert cell.write(Requester(PLC), [Change(NUMBER, 1)], 1.0) is None
    assert cell.write(Requester(HMI), [Change(NUMBER, 2)], 1.1) is not None
    refused = happened(audit)[-1]
    assert (refused.what, refused.writer, refused.holder, refused.old, refused.new, refused.reason) == (
        "write refused", "hmi", "plc", 1, 2, "held by another owner",
    )  # fmt: skip


def test_an_undeclared_peer_has_a_name_too(cell: Cell, audit: Audit) -> None:
    assert cell.write(Requester(None), [Change(NUMBER, 2)], 1.1) is not None
    assert happened(audit)[-1].writer == "undeclared"


def test_what_was_written_stands_before_the_fallback(cell: Cell, audit: Audit) -> None:
    for value in (1, 2, 3):
        assert cell.write(Requester(PLC), [Change(NUMBER, value)], 1.0) is None
    cell.writer_connected(Requester(PLC), 1.0)
    cell.writer_disconnected(Requester(PLC), 1.1, "closed")
    told = [(one.what, one.writer, one.old, one.new) for one in happened(audit)]
    assert told[-3:] == [
        ("lock released", "plc", None, None),
        ("write accepted", "plc", 1, 3),
        ("fallback applied", "gateway", 3, 0),
    ]


def test_the_local_operator_is_in_it(cell: Cell, audit: Audit) -> None:
    assert cell.operator.force(REAL, 2.5, 1.0, 3.0, "by anna") is None
    cell.tick(3.0)
    told = [(one.what, one.writer, one.new, one.detail) for one in happened(audit)]
    assert ("value forced", "operator", 2.5, "by anna") in told
    assert ("force ended", "operator", None, "time limit") in told


def test_unwatching_tells_the_rest_and_ends_it(cell: Cell, audit: Audit) -> None:
    audit.watch(cell)
    for value in (1, 2):
        assert cell.write(Requester(PLC), [Change(NUMBER, value)], 1.0) is None
    audit.follow(())
    audit.follow(())
    assert written(audit) == [("plc", 0, 1, 1), ("plc", 1, 2, 1)]
    assert cell.write(Requester(PLC), [Change(NUMBER, 9)], 9.0) is None
    audit.tick(99.0)
    assert len(list(audit)) == 3
    assert not cell.write_listeners


def test_the_ring_is_bounded(cell: Cell) -> None:
    audit = Audit(capacity=3)
    audit.watch(cell)
    for value in range(10):
        assert cell.write(Requester(PLC), [Change(NUMBER, value + 1)], value * 10.0) is None
    assert written(audit)[-3:] == [("plc", 7, 8, 1), ("plc", 8, 9, 1), ("plc", 9, 10, 1)]
    for value in range(10, 1000):
        assert cell.write(Requester(PLC), [Change(NUMBER, value + 1)], value * 10.0) is None
    assert len(list(audit)) < 300


def test_following_drops_cells_that_are_gone(cell: Cell, audit: Audit) -> None:
    other = Cell(definition())
    audit.follow([other])
    assert not cell.write_listeners
    assert len(other.write_listeners) == 1
    audit.follow([other])
    assert len(other.write_listeners) == 1


async def test_it_keeps_up_with_the_gateway_and_tells_the_rest_at_the_end(cell: Cell) -> None:
    audit = Audit()
    audit.watch(cell)
    running = asyncio.create_task(audit.run(lambda: [cell]))
    await asyncio.sleep(0)
    for value in (1, 2):
        assert cell.write(Requester(PLC), [Change(NUMBER, value)], 1.0) is None
    assert written(audit) == [("plc", 0, 1, 1)]
    running.cancel()
    await asyncio.wait((running,))
    assert written(audit) == [("plc", 0, 1, 1), ("plc", 1, 2, 1)]


def test_a_lease_that_is_taken_and_ends_again_and_again_leaves_the_evidence(
    cell: Cell, audit: Audit, lines: list[str]
) -> None:
    assert cell.write(Requester(HMI), [Change(REAL, 1.5)], 0.5) is None
    for turn in range(8 * 3600 // 5):
        now = 1 + 5.0 * turn
        assert cell.request(Requester(PLC), NUMBER, now) is None
        assert cell.release(Requester(PLC), NUMBER, now + 2.0) is None
        audit.tick(now + 3.0)
    assert "real" in [record.event.variable for record in audit]
    assert len(lines) < 3200, "half an hour of them one by one, then few"
    audit.tick(math.inf)
    taken = [record.event for record in audit if record.event.what == "lock acquired"]
    assert max(event.times for event in taken) > 1


def test_a_flood_is_merged_and_nothing_of_it_is_lost(cell: Cell, audit: Audit, lines: list[str]) -> None:
    for turn in range(5000):
        now = 1 + turn / 500
        assert cell.write(Requester(HMI), [Change(NUMBER, 2 * turn + 1)], now) is None
        assert cell.write(Requester(PLC), [Change(NUMBER, 2 * turn + 2)], now) is None
        assert cell.release(Requester(PLC), NUMBER, now) is None
        audit.tick(now)
    assert len(lines) < 300
    audit.tick(math.inf)
    counts = Counter[str]()
    for one in map(json.loads, lines):
        counts[one["what"]] += one.get("times", 1)
    assert counts == {
        "lock acquired": 5000,
        "write accepted": 10_000,
        "lock taken over": 5000,
        "lock released": 5000,
        "fallback applied": 5000,
    }


def test_a_writer_that_does_too_much_is_a_trouble(
    cell: Cell, audit: Audit, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gatewayd.audit.merging.ALARM", 10.0)
    for turn in range(2000):
        assert cell.request(Requester(PLC), NUMBER, 1.0) is None
        assert cell.release(Requester(PLC), NUMBER, 1.0) is None
        audit.append(Record(WALL, 1.0, "press", EventRecord(ACCEPTED, "plc", f"v{turn}")))
    audit.tick(1.0)
    assert audit.troubles == ["press: more audit records of plc than are kept one by one"]
    audit.tick(1000.0)
    audit.tick(1011.0)
    assert audit.troubles == []
    (told,) = caplog.records
    assert told.__dict__["fields"] == {"cell": "press", "writer": "plc"}
