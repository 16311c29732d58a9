"""What happened, in one sentence."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.core.succession import succeed
from gatewayd.report.event_text import ACCEPTED, BAD, EventRecord
from tests.control.served import CYCLES, LIMIT, Served, bring_up, plan

PLC, HMI = 0, 1
START, MOTION = 0, 2
"""Locks."""


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(plan().cell)


@pytest.mark.parametrize(
    "event, text",
    [
        (
            Event(0, EventKind.REFUSED, LIMIT, 1, HMI, PLC, Reason.HELD, 0.0, 12.5),
            "hmi wrote limit = 12.5 N: refused, held by plc",
        ),
        (
            Event(0, EventKind.REFUSED, LIMIT, 1, PLC, reason=Reason.OUT_OF_LIMITS, new=999.0, repeats=2),
            "plc wrote limit = 999 N: refused, value out of limits, 0..150 (3 times)",
        ),
        (
            Event(0, EventKind.REFUSED, LIMIT, 1, PLC, reason=Reason.OUT_OF_LIMITS, new=150.0000001),
            "plc wrote limit = 150.0000001 N: refused, value out of limits, 0..150",
        ),
        (
            Event(
                0, EventKind.REFUSED, LIMIT, 1, HMI, PLC, Reason.HELD, repeats=2, detail="the last 3.0 s ago"
            ),
            "hmi wrote limit: refused, held by plc (3 times, the last 3.0 s ago)",
        ),
        (
            Event(0, EventKind.REFUSED, reason=Reason.NO_SUCH_ADDRESS),
            "an undeclared peer wrote an address: refused, no variable at this address",
        ),
        (
            Event(0, EventKind.REFUSED, LIMIT, 1, reason=Reason.NOT_WRITABLE, new=5.0, peer="192.0.2.77"),
            "undeclared peer 192.0.2.77 wrote limit = 5 N: refused, never writable by this writer",
        ),
        (Event(0, EventKind.FALLBACK, LIMIT, old=5.0, new=0.0), "limit fell back from 5 to 0 N"),
        (Event(0, EventKind.ACQUIRED, lock=START, writer=PLC), "plc took start"),
        (
            Event(0, EventKind.ACQUIRED, lock=MOTION, writer=OPERATOR, detail="by anna"),
            "operator took motion (by anna)",
        ),
        (
            Event(0, EventKind.TAKEN_OVER, lock=MOTION, writer=OPERATOR, other=HMI, detail="by anna"),
            "operator took motion over from hmi (by anna)",
        ),
        (
            Event(0, EventKind.RELEASED, lock=START, writer=PLC, detail="lease ended"),
            "plc no longer holds start: lease ended",
        ),
        (Event(0, EventKind.WRITER_CONNECTED, writer=PLC), "writer plc connected"),
        (Event(0, EventKind.WRITER_LOST, writer=PLC, detail="closed"), "writer plc lost: closed"),
        (
            Event(0, EventKind.FORCED, LIMIT, 1, OPERATOR, old=1.0, new=3.0, detail="by anna"),
            "operator forced limit to 3 N (by anna)",
        ),
        (
            Event(0, EventKind.COMMANDED, LIMIT, writer=PLC, new=1.0, detail="play"),
            "plc gave the command limit: play",
        ),
        (
            Event(0, EventKind.COMMAND_REFUSED, LIMIT, writer=PLC, detail="in local control"),
            "the command limit of plc was refused: in local control",
        ),
        (
            Event(0, EventKind.UNFORCED, CYCLES, writer=OPERATOR, old=3, detail="time limit"),
            "cycles is no longer forced: time limit",
        ),
        (Event(0, EventKind.ROBOT_LOST, detail="cable"), "robot lost: cable"),
        (Event(0, EventKind.FRESH), "robot values fresh"),
        (Event(0, EventKind.UNAVAILABLE, CYCLES, detail="in use"), "cycles is unavailable: in use"),
        (Event(0, EventKind.AVAILABLE, CYCLES), "cycles is available"),
        (
            Event(0, EventKind.READ_BACK_DIFFERS, LIMIT, detail="sent 1, the controller holds 2"),
            "read-back of limit differs: sent 1, the controller holds 2",
        ),
        (Event(0, EventKind.FOLLOWED, LIMIT, old=7.0, new=99.0), "limit follows the robot: 7 -> 99 N"),
        (Event(0, EventKind.FOLLOWED, LIMIT), "limit follows the robot"),
        (
            Event(0, EventKind.ADOPTION_ENDS, LIMIT, detail="in 2 s"),
            "limit falls back soon (adopted, but owned by nobody): in 2 s",
        ),
        (Event(0, EventKind.ADOPTION_ENDS, detail="3 inputs"), "adopted values fall back soon: 3 inputs"),
        (Event(0, EventKind.STOOD_STILL, detail="4.8 s"), "gateway stood still: 4.8 s"),
        (
            Event(0, EventKind.UNAVAILABLE, CYCLES, detail="\x1b[31mINT\u202e\r\n"),
            "cycles is unavailable: \\x1b[31mINT\\u202e\\r\\n",
        ),
    ],
)
def test_an_event_is_one_sentence(cell: Cell, event: Event, text: str) -> None:
    assert EventRecord.of(event, cell.definition).text() == text


def test_whoever_takes_part_in_the_demonstration_is_you() -> None:
    def text(kind: EventKind, detail: str = "") -> str:
        return EventRecord(kind.value, "you", lock="speed", holder="plc", detail=detail).text()

    assert text(EventKind.RELEASED, "lease ended") == "you no longer hold speed: lease ended"
    assert text(EventKind.ACQUIRED) == "you took speed"
    assert text(EventKind.TAKEN_OVER) == "you took speed over from plc"
    assert text(EventKind.WRITER_CONNECTED) == "you connected"
    assert text(EventKind.WRITER_LOST, "closed") == "you left: closed"


@pytest.mark.parametrize("others", [0, 1, 2])
@pytest.mark.parametrize("writer", ["plc", "you"])
@pytest.mark.parametrize("kind", EventKind)
def test_subject_and_verb_agree(kind: EventKind, writer: str, others: int) -> None:
    record = EventRecord(kind.value, writer, "start", lock="start", holder="hmi", old=1, new=2)
    words = record.of_several(others).text().split()
    assert not {"holds", "has", "is"} & set(words) or (writer != "you" and not others) or "you" not in words
    if others and "more" in words:
        assert not {"is", "falls", "follows"} & set(words)


def test_an_accepted_write_is_one_too() -> None:
    accepted = EventRecord(ACCEPTED, "plc", "x", "N", old=1, new=2)
    assert accepted.text() == "plc wrote x: 1 -> 2 N"
    assert replace(accepted, times=5).text() == "plc wrote x: 1 -> 2 N (5 changes)"


@pytest.mark.parametrize(
    "event, text",
    [
        (Event(0, EventKind.ACQUIRED, lock=0, writer=0), "plc took start and 3 more"),
        (Event(0, EventKind.FALLBACK, variable=0, old=True, new=False), "start and 3 more fell back"),
        (
            Event(0, EventKind.UNAVAILABLE, variable=0, detail="in use"),
            "start and 3 more are unavailable: in use",
        ),
    ],
)
def test_what_befell_several_at_once_is_one_sentence(cell: Cell, event: Event, text: str) -> None:
    assert EventRecord.of(event, cell.definition).of_several(3).text() == text


def test_a_refusal_may_say_how() -> None:
    refused = EventRecord(
        EventKind.REFUSED.value, "hmi", "x", new=7, holder="plc", reason="held by another owner"
    )
    assert refused.text("refused with 06") == "hmi wrote x = 7: refused with 06, held by plc"


@pytest.mark.parametrize("kind", EventKind)
def test_every_kind_has_a_sentence_even_without_any_name(cell: Cell, kind: EventKind) -> None:
    sentence = EventRecord.of(Event(0, kind), cell.definition).text()
    assert sentence
    assert "None" not in sentence
    assert "{" not in sentence


def test_names_that_a_reload_has_removed_are_still_told() -> None:
    served = Served(plan(), Cell(plan().cell))
    bring_up(served.cell, 0.0)
    served.cell.set_availability([CYCLES], False, "in use", 1.0)
    after = succeed(served.cell, plan(extra="parts").cell, 2.0).cell
    told = [EventRecord.of(event, after.definition).text() for event in after.events]
    assert "register unavailable: in use, variable cycles, since removed" in told


def test_only_what_somebody_should_look_at_is_bad(cell: Cell) -> None:
    assert {kind for kind in EventKind if EventRecord.of(Event(0, kind), cell.definition).bad} == {
        EventKind.ROBOT_LOST,
        EventKind.STALE,
        EventKind.UNAVAILABLE,
        EventKind.READ_BACK_DIFFERS,
        EventKind.ADOPTION_ENDS,
        EventKind.STOOD_STILL,
        EventKind.WRITER_LOST,
        EventKind.REFUSED,
        EventKind.UNSERVED,
        EventKind.FORCED,
        EventKind.COMMAND_REFUSED,
    }
    assert ACCEPTED not in BAD


def test_several_at_one_moment_are_told_without_values(cell: Cell) -> None:
    def told(kind: EventKind) -> str:
        return EventRecord.of(Event(0, kind, LIMIT, old=1.0, new=2.0), cell.definition).of_several(3).text()

    assert told(EventKind.READ_BACK_DIFFERS) == "read-back of limit and 3 more differs"
    assert told(EventKind.FOLLOWED) == "limit and 3 more follow the robot"
    assert told(EventKind.ADOPTION_ENDS) == "limit and 3 more fall back soon (adopted, but owned by nobody)"
