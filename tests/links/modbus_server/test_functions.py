"""Execution: what a request does to the cell. The answers byte by byte are in test_conformance.py."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import replace

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import EXCEPTION_OF, Unit, execute
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.modbus.exceptions import ExceptionCode

PLC, HMI = 0, 1
NOW = 1000.0

IndexOf = Callable[[str], int]


def ask(unit: Unit, pdu: str, writer: int | None = PLC) -> str:
    return execute(unit, Requester(writer), bytes.fromhex(pdu), NOW).hex(" ")


def test_every_reason_has_its_exception() -> None:
    assert {reason.name: int(EXCEPTION_OF[reason]) for reason in Reason} == {
        "NO_SUCH_ADDRESS": 0x02,
        "NOT_WRITABLE": 0x02,
        "HELD": 0x06,
        "OUT_OF_LIMITS": 0x03,
        "PARTIAL_VALUE": 0x03,
        "ROBOT_LOST": 0x0B,
        "CLAIMED_ELSEWHERE": 0x0A,
        "HEARTBEAT_LOST": 0x0B,
        "PARTIAL_TAKEOVER": 0x03,
        "WAITED": 0x06,
        "NOT_MEANT": 0x06,
        "NOT_IN_ROLE": 0x01,
        "CONTRADICTED": 0x03,
    }


def test_one_request_is_one_write(cell: Cell, unit: Unit) -> None:
    """What comes together goes to the robot together."""
    calls: list[Direction] = []
    cell.listeners.append(calls.append)
    assert ask(unit, "10 000a 0004 08 0001 00000002 0003") == "10 00 0a 00 04"
    assert ask(unit, "0f 0000 000a 02 ff03") == "0f 00 00 00 0a"
    assert calls == [Direction.INPUT, Direction.INPUT]


def test_a_refused_request_changes_nothing(cell: Cell, unit: Unit) -> None:
    before = list(cell.image.values)
    assert ask(unit, "10 000a 0004 08 0001 00000002 7fff") == "90 03"
    assert cell.image.values == before
    assert cell.ownership.owners == [None] * len(cell.ownership.owners)


@pytest.mark.parametrize(
    "case",
    [
        ("06 0001 0000", Reason.NO_SUCH_ADDRESS, None),
        ("06 000b 0000", Reason.PARTIAL_VALUE, "count"),
        ("06 0064 0000", Reason.NOT_WRITABLE, "int_0"),
        ("06 000d 7fff", Reason.OUT_OF_LIMITS, "force"),
        ("05 000b ff00", Reason.NO_SUCH_ADDRESS, None),
        ("16 000b 0000 0000", Reason.PARTIAL_VALUE, "count"),
    ],
)
def test_every_refused_write_is_recorded(
    cell: Cell, unit: Unit, index_of: IndexOf, case: tuple[str, Reason, str | None]
) -> None:
    pdu, reason, variable = case
    ask(unit, pdu)
    assert cell.last_refusal is not None
    refusal = cell.last_refusal.refusal
    assert refusal == Refusal(
        reason, index_of(variable) if variable is not None else None, None, refusal.request, refusal.hint
    )
    assert bool(refusal.request) is (variable is None)
    assert cell.last_refusal.writer == PLC
    assert cell.health.writes_refused == 1


def test_reads_are_never_recorded_as_refusals(cell: Cell, unit: Unit) -> None:
    assert ask(unit, "03 0001 0001") == "83 02"
    assert cell.health.writes_refused == 0


def test_an_undeclared_peer_is_recorded_with_what_it_wanted(
    cell: Cell, unit: Unit, index_of: IndexOf
) -> None:
    assert ask(unit, "06 000a 0005", None) == "86 02"
    assert cell.last_refusal is not None
    assert cell.last_refusal.refusal == Refusal(Reason.NOT_WRITABLE, index_of("part"))
    assert cell.last_refusal.writer is None


def test_without_a_robot_writes_get_no_response(cell: Cell, unit: Unit) -> None:
    cell.robot_lost("cable", NOW)
    assert ask(unit, "06 000a 0005") == "86 0b"


def test_a_register_claimed_elsewhere_has_no_path(cell: Cell, unit: Unit, index_of: IndexOf) -> None:
    cell.set_availability([index_of("part")], available=False, reason="in use", now=NOW)
    assert ask(unit, "06 000a 0005") == "86 0a"


def test_reads_that_touch_what_the_robot_no_longer_tells_get_no_response(cell: Cell, unit: Unit) -> None:
    """Only where the policy is `exception`, and unmapped addresses stay unmapped."""
    cell.robot_lost("cable", NOW)
    assert ask(unit, "03 012c 0001") == "83 0b"
    assert ask(unit, "03 012d 0002") == "03 04 00 00 00 00"
    assert ask(unit, "03 012c 0005") == "83 02"
    assert ask(unit, "02 0028 0001") == "82 0b"
    assert ask(unit, "03 0064 0002") == "03 04 00 00 00 00"


@pytest.mark.parametrize("away", [code for code in ExceptionCode if code > ExceptionCode.ILLEGAL_VALUE])
def test_the_answer_to_a_robot_that_is_away_can_be_chosen(
    cell: Cell, plan_of: Callable[..., ModbusPlan], away: ExceptionCode, index_of: IndexOf
) -> None:
    """Some SCADA drivers take 0B for the end of the whole device. All that fails for this one reason gets it."""
    unit = Unit(replace(plan_of(), robot_away=away), cell)
    cell.set_availability([index_of("part")], available=False, reason="in use", now=NOW)
    assert ask(unit, "06 000a 0005") == "86 0a", "a register that somebody else holds is another matter"
    cell.robot_lost("cable", NOW)
    requests = (
        "03 012c 0001",
        "02 0028 0001",
        "06 000b 0000",
        "17 012c 0001 000a 0001 02 0007",
        "05 0000 ff00",
    )
    code = f"{away:02x}"
    expected = ["83 " + code, "82 " + code, "86 03", "97 " + code, "85 " + code]
    assert [ask(unit, pdu) for pdu in requests] == expected
    assert ask(unit, "03 0001 0001") == "83 02", "what is not mapped stays so"


def test_what_gaps_swallow_is_counted_once_it_is_acknowledged(
    cell: Cell, plan_of: Callable[..., ModbusPlan], index_of: IndexOf
) -> None:
    unit = Unit(replace(plan_of(), ignore_gaps=True), cell)
    assert ask(unit, "10 0009 0002 04 0001 0005") == "10 00 09 00 02"
    assert cell.image.values[index_of("part")] == 5
    assert unit.ignored == 1
    assert ask(unit, "16 0000 fffa 0005") == "16 00 00 ff fa 00 05"
    assert unit.ignored == 2
    assert ask(unit, "06 0001 0001") == "86 02", "nothing mapped"
    assert ask(unit, "10 0009 0002 04 0001 0005", None) == "90 02", "not a writer"
    assert ask(unit, "10 0009 0005 0a 0001 0005 0000 0000 7fff") == "90 03", "out of limits"
    assert unit.ignored == 2
    assert Unit(unit.plan, cell, unit).ignored == 2


def test_a_server_whose_robot_is_away_does_not_run(cell: Cell, unit: Unit) -> None:
    assert ask(unit, "11")[6:11] == "01 ff"
    cell.robot_lost("cable", NOW)
    assert ask(unit, "11")[6:11] == "01 00"
    assert ask(unit, "08 0000 0001") == "08 00 00 00 01", "the gateway itself is there"


def test_a_read_that_is_refused_keeps_its_request_from_writing(
    cell: Cell, unit: Unit, index_of: IndexOf
) -> None:
    cell.set_availability([index_of("fragile")], available=False, reason="no such field", now=NOW)
    assert ask(unit, "17 012c 0001 000a 0001 02 0007") == "97 0b"
    assert ask(unit, "17 0001 0001 000a 0001 02 0007") == "97 02"
    assert ask(unit, "03 000a 0001") == "03 02 00 00"


def test_a_mask_is_atomic_on_what_the_register_holds_now(cell: Cell, unit: Unit, index_of: IndexOf) -> None:
    assert ask(unit, "06 0000 0001", PLC) == "06 00 00 00 01"
    assert ask(unit, "16 0000 fffd 0002", HMI) == "16 00 00 ff fd 00 02"
    assert [cell.image.values[index_of(name)] for name in ("start", "stop", "mode")] == [True, True, False]


def test_a_mask_that_selects_nothing_takes_no_lock(cell: Cell, unit: Unit) -> None:
    assert ask(unit, "16 0000 ffff ffff") == "16 00 00 ff ff ff ff"
    assert cell.ownership.held_by(PLC) == []


def test_not_a_number_passes_where_no_limits_are(cell: Cell, unit: Unit, index_of: IndexOf) -> None:
    nan = struct.pack(">d", math.nan).hex()
    assert ask(unit, f"10 000e 0004 08 {nan}") == "10 00 0e 00 04"
    assert math.isnan(cell.image.values[index_of("speed")])


def test_locks_are_taken_and_given_back_by_the_status_block(
    cell: Cell, unit: Unit, index_of: IndexOf
) -> None:
    number = index_of("part") + 1
    assert ask(unit, f"06 ea88 {number:04x}") == f"06 ea 88 00 {number:02x}"
    assert cell.ownership.held_by(PLC)
    assert ask(unit, f"06 ea88 {number:04x}", HMI) == "86 06"
    assert ask(unit, f"03 {60192 + index_of('part'):04x} 0001") == "03 02 00 01", "the owner is shown"
    assert ask(unit, f"06 ea89 {number:04x}") == f"06 ea 89 00 {number:02x}"
    assert not cell.ownership.held_by(PLC)


def test_a_write_is_seen_by_the_next_read(cell: Cell, unit: Unit, index_of: IndexOf) -> None:
    assert cell.write(Requester(HMI), [Change(index_of("count"), 5)], NOW) is None
    assert ask(unit, "03 000b 0002") == "03 04 00 00 00 05"
