"""Events and addresses in words."""

from __future__ import annotations

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.mapping.plan import Area, Placement
from gatewayd.status.words import AREAS, BAD, address, describe, number
from tests.status.press import CYCLES, FORCE_LIMIT, HMI, PLC


@pytest.mark.parametrize(
    "event, text",
    [
        (
            Event(0, EventKind.REFUSED, FORCE_LIMIT, 1, HMI, PLC, Reason.HELD, 0.0, 12.5, 2),
            "hmi wrote force_limit = 12.5 N: refused, held by plc (3 times)",
        ),
        (
            Event(0, EventKind.REFUSED, reason=Reason.NO_SUCH_ADDRESS),
            "a stranger wrote an address without a variable: refused, no variable at this address",
        ),
        (Event(0, EventKind.FALLBACK, FORCE_LIMIT, old=5.0, new=0.0), "force_limit fell back to 0 N"),
        (Event(0, EventKind.ACQUIRED, lock=0, writer=PLC), "plc took start"),
        (
            Event(0, EventKind.TAKEN_OVER, lock=1, writer=OPERATOR, other=HMI),
            "operator took force_limit over from hmi",
        ),
        (
            Event(0, EventKind.RELEASED, lock=0, writer=PLC, detail="lease ended"),
            "start is free: lease ended",
        ),
        (Event(0, EventKind.WRITER_LOST, writer=PLC, detail="closed"), "plc lost: closed"),
        (Event(0, EventKind.FORCED, CYCLES, new=3), "cycles forced to 3 by the local operator"),
        (Event(0, EventKind.UNFORCED, CYCLES, detail="time limit"), "cycles no longer forced: time limit"),
        (Event(0, EventKind.ROBOT_LOST, detail="cable"), "robot lost: cable"),
        (
            Event(0, EventKind.UNAVAILABLE, CYCLES, detail="in use"),
            "register unavailable cycles: in use",
        ),
    ],
)
def test_an_event_is_one_sentence(cell: Cell, event: Event, text: str) -> None:
    assert describe(event, cell.definition) == text


def test_what_befell_several_at_once_is_one_sentence(cell: Cell) -> None:
    assert (
        describe(Event(0, EventKind.ACQUIRED, lock=0, writer=0), cell.definition, 3)
        == "plc took start and 3 more"
    )


@pytest.mark.parametrize("kind", EventKind)
def test_every_kind_has_a_sentence(cell: Cell, kind: EventKind) -> None:
    assert describe(Event(0, kind), cell.definition)


def test_a_taken_lock_is_no_trouble() -> None:
    assert EventKind.ACQUIRED not in BAD
    assert EventKind.REFUSED in BAD


def test_addresses_have_both_forms() -> None:
    assert address(Placement(0, Area.HOLDING, 0, 10, None)) == ("0.10", "400001.10")
    assert address(Placement(0, Area.DISCRETE, 64, None, None)) == ("64", "100065")
    assert set(AREAS) == set(Area)


def test_numbers_are_short() -> None:
    assert [number(one) for one in (True, 3, 0.1 + 0.2, 2.0)] == ["1", "3", "0.3", "2"]
    assert number(1.5, "N") == "1.5 N"
