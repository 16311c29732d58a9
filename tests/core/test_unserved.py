"""Requests that nothing here serves: counted, merged by peer and reason, reported in words."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal_log import REFUSAL_INTERVAL
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import FIELDS
from gatewayd.core.succession import succeed
from gatewayd.core.unserved import Unserved
from gatewayd.report.event_text import EventRecord
from tests.core.conftest import PLC

OFFSET = {field.name: field.offset for field in FIELDS}


def reported(cell: Cell) -> list[Event]:
    return [event for event in cell.events if event.kind is EventKind.UNSERVED]


def texts(cell: Cell) -> list[str]:
    return [EventRecord.of(event, cell.definition).text() for event in reported(cell)]


def test_every_reason_has_its_words() -> None:
    assert len({reason.text for reason in Unserved}) == len(Unserved)


def test_what_is_asked_in_vain_is_counted_and_said_once_for_each_peer_and_reason(cell: Cell) -> None:
    stranger = Requester(None, "192.0.2.7")
    for moment in range(5):
        cell.unserved(Requester(PLC), Unserved.NO_SUCH_UNIT, "asked unit 7; units here: 1", moment)
        cell.unserved(stranger, Unserved.NO_SUCH_UNIT, "asked unit 9; units here: 1", moment)
    cell.unserved(Requester(PLC), Unserved.MALFORMED, "asked for function 3: quantity 0", 5.0)
    assert texts(cell) == [
        "plc asked unit 7; units here: 1",
        "undeclared peer 192.0.2.7 asked unit 9; units here: 1",
        "plc asked for function 3: quantity 0",
    ]
    assert cell.health.unserved[Unserved.NO_SUCH_UNIT] == 10
    assert cell.health.unserved[Unserved.MALFORMED] == 1
    cell.tick(REFUSAL_INTERVAL + 0.5)
    assert "plc asked unit 7; units here: 1 (4 times, the last 6.5 s ago)" in texts(cell)


def test_it_is_no_refused_write(cell: Cell) -> None:
    cell.unserved(Requester(PLC), Unserved.NO_SUCH_ADDRESS, "read holding 7", 1.0)
    assert cell.health.writes_refused == 0
    assert cell.last_refusal is None
    assert not cell.writers.alive[PLC]


def test_the_status_block_counts_it_and_has_the_last_reason(cell: Cell) -> None:
    status = StatusBlock(cell)
    assert status.read(OFFSET["unserved"], 3, 0.0) == bytes(6)
    cell.unserved(Requester(PLC), Unserved.NO_SUCH_ADDRESS, "read holding 7", 1.0)
    cell.unserved(Requester(None), Unserved.NO_SUCH_UNIT, "asked unit 7", 1.0)
    assert status.read(OFFSET["unserved"], 3, 1.0).hex(" ", 2) == "0000 0002 0001"


def test_a_reload_goes_on_counting(cell: Cell, press: CellDefinition) -> None:
    for _ in range(3):
        cell.unserved(Requester(PLC), Unserved.NO_SUCH_ADDRESS, "read holding 7", 1.0)
    successor = succeed(cell, press, 2.0).cell
    assert successor.health.unserved[Unserved.NO_SUCH_ADDRESS] == 3
    assert successor.last_unserved is not None
    assert successor.last_unserved.request == "read holding 7"
    successor.tick(1.0 + REFUSAL_INTERVAL)
    assert texts(successor)[-1] == "plc read holding 7 (2 times, the last 10.0 s ago)"
