from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.session import ModbusSession, UnitAccess
from gatewayd.modbus.frames import encode

PLC = 0
NOW = 1000.0

REQUESTS = (
    "03 000a 0001",
    "06 000a 0001",
    "03 000a 0001",
    "10 000a 0003 06 0002 0000 0003",
    "04 0000 007d",
    "17 000a 0003 000a 0001 02 0009",
    "01 0000 000a",
    "63",
    "03 0064 0030",
    "2b 0e 01 00",
)


@pytest.fixture
def session(unit: Unit) -> ModbusSession:
    session = ModbusSession()
    session.serve({1: UnitAccess(unit, Requester(PLC))})
    return session


@pytest.mark.parametrize(
    "pdu", ["06 000a 0005", "06 ea80 0001", "06 3a98 0001"], ids=["value", "lock", "nothing"]
)
def test_a_refused_undeclared_peer_is_named_by_its_address(cell: Cell, unit: Unit, pdu: str) -> None:
    """Whoever mends the mapping has to know what to write under `writers:`."""
    session = ModbusSession()
    session.serve({1: UnitAccess(unit, Requester(None, "192.0.2.77"))})
    feed(session, stream(pdu))
    assert cell.last_refusal is not None
    assert cell.last_refusal.peer == "192.0.2.77"
    assert [event.peer for event in cell.events if event.kind is EventKind.REFUSED] == ["192.0.2.77"]


def test_a_writer_is_named_by_its_name_alone(cell: Cell, unit: Unit) -> None:
    session = ModbusSession()
    session.serve(
        {
            1: UnitAccess(unit, Requester(None, "192.0.2.77")),
            2: UnitAccess(unit, Requester(PLC, "192.0.2.20")),
        }
    )
    feed(session, stream("06 000a 0005", unit=1))
    feed(session, stream("06 3a98 0001", unit=2))
    assert [event.peer for event in cell.events if event.kind is EventKind.REFUSED] == ["192.0.2.77", ""]


def feed(session: ModbusSession, data: bytes, sizes: list[int] | None = None) -> bytes:
    """Hand `data` over in pieces of the given sizes, over and over."""
    answers = b""
    position = turn = 0
    while position < len(data):
        size = min((sizes or [len(data)])[turn % len(sizes or [0])], len(session.buffer.space[0]))
        piece = data[position : position + size]
        session.buffer.space[0][: len(piece)] = piece
        answers += session.received(len(piece), NOW)
        while session.pending:
            answers += session.received(0, NOW)
        position += len(piece)
        turn += 1
    return answers


def stream(*requests: str, unit: int = 1) -> bytes:
    return b"".join(encode(number, unit, bytes.fromhex(pdu)) for number, pdu in enumerate(requests, 1))


def fresh(unit: Unit) -> ModbusSession:
    """A session over the same cell, with the values all tests begin with."""
    session = ModbusSession()
    session.serve({1: UnitAccess(unit, Requester(PLC))})
    feed(session, stream("06 000a 0000", "10 000b 0002 04 00000000"))
    return session


def test_answers_come_in_the_order_of_the_requests(unit: Unit) -> None:
    answers = feed(fresh(unit), stream(*REQUESTS))
    transactions = []
    position = 0
    while position < len(answers):
        transactions.append(int.from_bytes(answers[position : position + 2], "big"))
        position += 6 + int.from_bytes(answers[position + 4 : position + 6], "big")
    assert transactions == list(range(1, len(REQUESTS) + 1))


def test_a_stream_may_be_cut_anywhere(unit: Unit) -> None:
    data = stream(*REQUESTS)
    expected = feed(fresh(unit), data)
    for cut in range(1, len(data)):
        assert feed(fresh(unit), data, [cut, len(data)]) == expected


def test_a_stream_may_come_byte_by_byte(unit: Unit) -> None:
    data = stream(*REQUESTS)
    assert feed(fresh(unit), data, [1]) == feed(fresh(unit), data)


@given(sizes=st.lists(st.integers(1, 400), min_size=1, max_size=8), depth=st.integers(1, 400))
def test_any_depth_of_pipelining_is_answered(sizes: list[int], depth: int) -> None:
    """More than the buffer holds as well."""
    session = ModbusSession()
    data = stream(*["07"] * depth, unit=9)
    expected = b"".join(encode(number, 9, bytes.fromhex("87 0b")) for number in range(1, depth + 1))
    assert feed(session, data, sizes) == expected


def test_answers_of_one_segment_are_joined(session: ModbusSession) -> None:
    data = stream("03 000a 0001", "03 000a 0001")
    session.buffer.space[0][: len(data)] = data
    assert len(session.received(len(data), NOW)) == 2 * 11


def test_a_few_requests_are_answered_at_a_time(session: ModbusSession) -> None:
    """However many came in at once, so that others have their turn; in order, to the last."""
    data = stream(*["03 000a 0001", "06 000a 0000"] * 20)
    session.buffer.space[0][: len(data)] = data
    parts = [session.received(len(data), NOW)]
    while session.pending:
        assert session.buffer.space[0]
        parts.append(session.received(0, NOW))
    assert [part.count(bytes.fromhex("0000 0005 01 03 02")) for part in parts] == [4] * 5 + [0]
    assert b"".join(parts) == feed(session, data)


def test_what_is_no_frame_is_reported_after_the_answers_before_it(session: ModbusSession) -> None:
    answers = feed(session, stream("03 000a 0001") + bytes.fromhex("0002 0001 0006 01 03 000a 0001"))
    assert answers == bytes.fromhex("0001 0000 0005 01 03 02 0000")
    assert session.broken == "protocol id 1 instead of 0"


def test_the_quick_way_and_the_other_one_agree(unit: Unit) -> None:
    """Reads are answered by the loop itself where they can be; nobody must be able to tell."""
    session = ModbusSession()
    session.serve({1: UnitAccess(unit, Requester(PLC)), 2: UnitAccess(unit, Requester(None))})
    for pdu in (
        "03 000a 0006",
        "04 0000 0006",
        "03 0000 0001",
        "03 0000 0002",
        "03 000a 0000",
        "04 0030 0001",
    ):
        quick = feed(session, stream(pdu))
        assert quick == encode(1, 1, execute(unit, Requester(PLC), bytes.fromhex(pdu), NOW))


def test_with_two_units_the_device_itself_is_not_known(unit: Unit) -> None:
    session = ModbusSession()
    session.serve({1: UnitAccess(unit, Requester(PLC)), 2: UnitAccess(unit, Requester(PLC))})
    assert feed(session, stream("03 000a 0001", unit=0)) == bytes.fromhex("0001 0000 0003 00 83 0b")
    assert feed(session, stream("03 000a 0001", unit=255)) == bytes.fromhex("0001 0000 0003 ff 83 0b")
    assert feed(session, stream("03 000a 0001", unit=2)) == bytes.fromhex("0001 0000 0005 02 03 02 0000")


@pytest.mark.parametrize(
    "defaults, answers", [((False, True), True), ((True, True), False), ((False, False), False)]
)
def test_of_several_units_the_declared_one_is_the_device_itself(
    cell: Cell, plan_of: Callable[..., ModbusPlan], defaults: tuple[bool, bool], answers: bool
) -> None:
    """If two are declared, which `check` refuses, neither is: nobody is to write to the wrong robot."""
    units = [
        Unit(replace(plan_of(number), default_unit=default), cell)
        for number, default in enumerate(defaults, 1)
    ]
    session = ModbusSession()
    session.serve({unit.plan.unit: UnitAccess(unit, Requester(PLC)) for unit in units})
    for number in (0, 255):
        server = feed(session, stream("11", unit=number))[7:]
        assert (server[2] == 2) if answers else (server == bytes.fromhex("91 0b"))
        quick = feed(session, stream("03 000a 0001", unit=number))[7:]
        assert quick == bytes.fromhex("03 02 00 00" if answers else "83 0b")


def test_a_request_is_a_sign_of_life_for_the_unit_it_is_for(
    new_cell: Callable[[float], Cell], plan_of: Callable[..., ModbusPlan]
) -> None:
    cells = [new_cell(NOW), new_cell(NOW)]
    units = {number: Unit(plan_of(number), cell) for number, cell in enumerate(cells, 1)}
    session = ModbusSession()
    session.serve({number: UnitAccess(unit, Requester(PLC)) for number, unit in units.items()})
    feed(session, stream("03 000a 0001", unit=2))
    assert [cell.writers.alive[PLC] for cell in cells] == [False, True]
    feed(session, stream("07", unit=1))
    assert cells[0].writers.alive[PLC]


def test_units_can_be_exchanged_between_two_requests(session: ModbusSession, unit: Unit) -> None:
    session.serve({})
    assert feed(session, stream("03 000a 0001")) == bytes.fromhex("0001 0000 0003 01 83 0b")
    session.serve({7: UnitAccess(unit, Requester(PLC))})
    assert feed(session, stream("03 000a 0001", unit=7)) == bytes.fromhex("0001 0000 0005 07 03 02 0000")


def test_what_is_held_back_is_so_for_connections_that_exist(session: ModbusSession, cell: Cell) -> None:
    request = stream("03 012c 0001")
    assert feed(session, request) == bytes.fromhex("0001 0000 0005 01 03 02 0000")
    cell.robot_lost("cable", NOW)
    assert feed(session, request) == bytes.fromhex("0001 0000 0003 01 83 0b")
    cell.robot_connected(NOW)
    cell.package_arrived(2.0, NOW)
    cell.outputs_written(NOW)
    assert feed(session, request) == bytes.fromhex("0001 0000 0005 01 03 02 0000")
