"""Events as log lines: names instead of indices, one line each, loud enough and no louder."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import replace

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Limits, Lock, ValueKind, Variable, Writer
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.logs.events import LEVELS, EventLog


@pytest.fixture
def cell() -> Cell:
    one = Cell(
        CellDefinition(
            name="press",
            fingerprint=1,
            variables=(
                Variable(
                    1, "start", Direction.INPUT, ValueKind.BOOL, "input_bit_registers0_to_31", 0, lock=0
                ),
                Variable(2, "count", Direction.OUTPUT, ValueKind.INT, "output_int_register_0"),
            ),
            locks=(Lock("start", (0,), (0, 1)),),
            writers=(Writer("plc"), Writer("hmi")),
            stale_after=1,
        )
    )
    one.events.listeners.append(EventLog(one))
    return one


def reported(caplog: pytest.LogCaptureFixture) -> tuple[str, int, dict[str, object]]:
    (record,) = caplog.records
    return record.getMessage(), record.levelno, record.__dict__["fields"]


def test_a_refusal_names_everybody(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    event = Event(
        1.0,
        EventKind.REFUSED,
        variable=0,
        lock=0,
        writer=1,
        other=0,
        reason=Reason.HELD,
        old=False,
        new=True,
        repeats=3,
    )
    cell.events.append(event)
    assert reported(caplog) == (
        "write refused",
        logging.WARNING,
        {
            "cell": "press",
            "variable": "start",
            "field": "input_bit_registers0_to_31",
            "writer": "hmi",
            "holder": "plc",
            "reason": "held by another owner",
            "old": False,
            "new": True,
            "repeats": 3,
        },
    )


def test_a_peer_without_a_name_is_undeclared(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    cell.events.append(
        Event(1.0, EventKind.REFUSED, variable=1, reason=Reason.NOT_WRITABLE, peer="192.0.2.77")
    )
    fields = reported(caplog)[2]
    assert (fields["writer"], fields["peer"]) == ("undeclared", "192.0.2.77")


def test_a_value_out_of_limits_is_told_with_them(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    count = replace(cell.definition.variables[1], limits=Limits(0.0, 150.0))
    cell.events.listeners = [EventLog(Cell(replace(cell.definition, variables=(count,))))]
    cell.events.append(
        Event(1.0, EventKind.REFUSED, variable=0, writer=0, reason=Reason.OUT_OF_LIMITS, new=999)
    )
    assert reported(caplog)[2]["limits"] == "0..150"


def test_a_takeover_names_the_former_owner(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    cell.events.append(Event(1.0, EventKind.TAKEN_OVER, lock=0, writer=0, other=1))
    assert reported(caplog) == (
        "lock taken over",
        logging.WARNING,
        {"cell": "press", "lock": "start", "writer": "plc", "former": "hmi"},
    )


@pytest.mark.parametrize("kind", EventKind)
def test_every_kind_is_one_line_at_its_level(
    cell: Cell, caplog: pytest.LogCaptureFixture, kind: EventKind
) -> None:
    caplog.set_level(logging.DEBUG, "gatewayd.cell")
    cell.events.append(Event(1.0, kind, detail="why"))
    text, level, fields = reported(caplog)
    assert (text, level) == (kind.value, LEVELS.get(kind, logging.INFO))
    assert fields["detail"] == "why"


def test_locks_that_come_and_go_are_for_debugging(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "gatewayd.cell")
    cell.events.append(Event(1.0, EventKind.ACQUIRED, lock=0, writer=0))
    cell.events.append(Event(1.0, EventKind.RELEASED, lock=0, writer=0))
    assert not caplog.records


WORD = "input_bit_registers0_to_31"


@pytest.fixture
def word() -> Cell:
    """A word of bits in two ranges, and a number."""
    names = [*(f"bits[{n}]" for n in range(12)), "start", *(f"lamp[{n}]" for n in range(2))]
    variables = [
        Variable(n + 1, name, Direction.INPUT, ValueKind.BOOL, WORD, n, lock=0)
        for n, name in enumerate(names)
    ]
    number = Variable(
        len(names) + 1, "number", Direction.INPUT, ValueKind.INT, "input_int_register_0", lock=0
    )
    one = Cell(
        CellDefinition(
            name="press",
            fingerprint=1,
            variables=(*variables, number),
            locks=(Lock("all", tuple(range(len(names) + 1)), (0,)),),
            writers=(Writer("plc"),),
            stale_after=1,
        )
    )
    one.events.listeners.append(EventLog(one))
    return one


def lines(caplog: pytest.LogCaptureFixture) -> list[tuple[str, object]]:
    found = [(record.getMessage(), record.__dict__["fields"]) for record in caplog.records]
    return [(text, fields.get("variables", fields.get("variable"))) for text, fields in found]


async def test_what_befalls_many_variables_alike_is_one_line(
    word: Cell, caplog: pytest.LogCaptureFixture
) -> None:
    """A word of 32 bits that is claimed elsewhere is one misfortune, not 32."""
    for index in (*range(10), 11, 12, 13, 14, 15):
        word.events.append(Event(1.0, EventKind.UNAVAILABLE, variable=index, detail="IN_USE"))
    await asyncio.sleep(0)
    assert lines(caplog) == [
        ("register unavailable", "bits[0..9] bits[11] start lamp[0..1]"),
        ("register unavailable", "number"),
    ]
    assert caplog.records[0].__dict__["fields"]["field"] == WORD


async def test_what_differs_is_told_apart_and_in_order(word: Cell, caplog: pytest.LogCaptureFixture) -> None:
    for index, old in enumerate((True, True, False, True)):
        word.events.append(Event(1.0, EventKind.FALLBACK, variable=index, old=old, new=False))
    word.events.append(Event(1.0, EventKind.WRITER_LOST, writer=0))
    word.events.append(Event(1.0, EventKind.FALLBACK, variable=4, old=True, new=False))
    await asyncio.sleep(0)
    assert lines(caplog) == [
        ("fallback applied", "bits[0..1]"),
        ("fallback applied", "bits[2]"),
        ("fallback applied", "bits[3]"),
        ("writer lost", None),
        ("fallback applied", "bits[4]"),
    ]


def test_what_the_local_operator_does_is_told_at_the_default_level(
    cell: Cell, caplog: pytest.LogCaptureFixture
) -> None:
    cell.operator.take_lock(0, 1.0, detail="by anna")
    assert reported(caplog) == (
        "lock acquired",
        logging.WARNING,
        {"cell": "press", "lock": "start", "writer": "operator", "detail": "by anna"},
    )
