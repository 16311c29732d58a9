"""Events as log lines: names instead of indices, one line each, loud enough and no louder."""

from __future__ import annotations

import logging

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.eventlog import LEVELS, EventLog


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


def told(caplog: pytest.LogCaptureFixture) -> tuple[str, int, dict[str, object]]:
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
    assert told(caplog) == (
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
    cell.events.append(Event(1.0, EventKind.REFUSED, variable=1, reason=Reason.NOT_WRITABLE))
    assert told(caplog)[2]["writer"] == "undeclared"


def test_a_takeover_names_the_former_owner(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    cell.events.append(Event(1.0, EventKind.TAKEN_OVER, lock=0, writer=0, other=1))
    assert told(caplog) == (
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
    text, level, fields = told(caplog)
    assert (text, level) == (kind.value, LEVELS.get(kind, logging.INFO))
    assert fields["detail"] == "why"


def test_locks_that_come_and_go_are_for_debugging(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "gatewayd.cell")
    cell.events.append(Event(1.0, EventKind.ACQUIRED, lock=0, writer=0))
    cell.events.append(Event(1.0, EventKind.RELEASED, lock=0, writer=0))
    assert not caplog.records
