"""What a first day with a PLC brings: wrong units, wrong addresses, wrong quantities, and the words for them."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.session import ModbusSession, UnitAccess
from gatewayd.links.modbus_server.unserved import Places
from gatewayd.mapping.loader import load
from gatewayd.modbus.areas import Area
from gatewayd.modbus.describe import Span, fault
from gatewayd.modbus.frames import encode
from gatewayd.report.event_text import EventRecord

PLC = 0
NOW = 1000.0


def texts(cell: Cell) -> list[str]:
    kinds = (EventKind.UNSERVED, EventKind.REFUSED)
    return [EventRecord.of(event, cell.definition).text() for event in cell.events if event.kind in kinds]


@pytest.mark.parametrize(
    "pdu, reason, text",
    [
        (
            "03 000a 0009",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 10-18: 18 is not mapped; nearest: speed 14",
        ),
        (
            "03 0063 0001",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 99: 99 is not mapped; nearest: int_0 100",
        ),
        (
            "04 0bb8 0001",
            Unserved.NO_SUCH_ADDRESS,
            "plc read input 3000: 3000 is not mapped; nearest: int_23 46",
        ),
        (
            "03 9ca5 0001",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 40101: 40101 is not mapped; addresses count from 0: 40101 is 100 here",
        ),
        ("01 000b 0001", Unserved.NO_SUCH_ADDRESS, "plc read coil 11: 11 is not mapped; nearest: lamp 10"),
        (
            "03 ea5f 0002",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 59999-60000: 59999 is not mapped; nearest: bit_16 501.0",
        ),
        (
            "03 fd1f 0002",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 64799-64800: the status block, 60000-64799, needs a request of its own",
        ),
        (
            "03 ffff 0002",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 65535-65536: 65535 is not mapped; nearest: bit_16 501.0",
        ),
        (
            "07",
            Unserved.NO_SUCH_FUNCTION,
            "plc asked for function 7 (read exception status), which is not served",
        ),
        (
            "03 0064 0000",
            Unserved.MALFORMED,
            "plc asked for function 3 (read holding registers): quantity 0 is not within 1 to 125",
        ),
        (
            "10 000a 0002 02 0001",
            Unserved.MALFORMED,
            "plc asked for function 16 (write registers): its data does not fit quantity 2, which needs length 4",
        ),
        (
            "17 0063 0001 000a 0001 02 0009",
            Unserved.NO_SUCH_ADDRESS,
            "plc read holding 99: 99 is not mapped; nearest: int_0 100",
        ),
        (
            "2b 0e 09 00",
            Unserved.MALFORMED,
            "plc asked for function 43 (encapsulated interface) with wrong data",
        ),
    ],
)
def test_what_a_unit_does_not_serve_is_counted_and_said(
    cell: Cell, unit: Unit, pdu: str, reason: Unserved, text: str
) -> None:
    answer = execute(unit, Requester(PLC), bytes.fromhex(pdu), NOW)
    assert answer[0] & 0x80
    assert texts(cell) == [text]
    assert cell.health.unserved[reason] == sum(cell.health.unserved.values()) == 1
    assert cell.health.writes_refused == 0


@pytest.mark.parametrize(
    "pdu, text",
    [
        (
            "06 0065 0001",
            "plc wrote holding 101: refused, never writable by this writer",
        ),
        (
            "06 0001 0007",
            "plc wrote holding 1: refused, no variable at this address (1 is not mapped; nearest: start 0.0)",
        ),
        (
            "10 0008 0003 06 0000 0000 0000",
            "plc wrote holding 8-10: refused, no variable at this address (8 is not mapped; nearest: part 10)",
        ),
        (
            "05 000b ff00",
            "plc wrote coil 11: refused, no variable at this address (11 is not mapped; nearest: lamp 10)",
        ),
        (
            "16 0013 0000 0001",
            "plc wrote holding 19: refused, no variable at this address (19 is not mapped; nearest: half 20.0)",
        ),
    ],
)
def test_a_refused_write_names_its_address(cell: Cell, unit: Unit, pdu: str, text: str) -> None:
    execute(unit, Requester(PLC), bytes.fromhex(pdu), NOW)
    (found,) = texts(cell)
    if "no variable" in text:
        assert found == text
    assert sum(cell.health.unserved.values()) == 0, "it is a refused write, and counts once"


def test_what_is_nearest_is_called_as_the_file_has_it() -> None:
    """A byte of a register is `.high` or `.low`, no bit."""
    text = b"""
gatewayd: 1
cell: grip
robot: {host: 127.0.0.1}
modbus: {listen: '127.0.0.1:1502'}
variables:
  force: {robot: output_int_register_0, modbus: {holding: 7.high, type: uint8}}
  far:   {robot: output_bit_register_3, modbus: {holding: 90.12}}
"""
    plan = load(text, "grip.yaml").plan
    assert plan is not None
    places = Places(plan.the(ModbusPlan), plan.cell)
    found = [places.unmapped(Span(Area.HOLDING, address, 1), lambda _address: False) for address in (9, 80)]
    assert found == ["9 is not mapped; nearest: force 7.high", "80 is not mapped; nearest: far 90.12"]


def test_what_is_held_back_without_the_robot_is_said(cell: Cell, unit: Unit) -> None:
    cell.robot_lost("unplugged", NOW)
    execute(unit, Requester(PLC), bytes.fromhex("03 012c 0001"), NOW)
    assert texts(cell) == ["plc read holding 300: held back while the robot does not report it"]
    assert cell.health.unserved[Unserved.ROBOT_LOST] == 1


def test_a_unit_that_is_not_there(
    new_cell: Callable[[float], Cell], plan_of: Callable[..., ModbusPlan]
) -> None:
    """The cell that the peer writes to hears of it; for a peer that writes nowhere, all that it reaches."""
    first, second = new_cell(NOW), new_cell(NOW)
    units = {1: Unit(plan_of(1), first), 2: Unit(plan_of(2), second)}

    def ask(writer: int | None) -> bytes:
        session = ModbusSession()
        session.serve(
            {
                1: UnitAccess(units[1], Requester(writer, "192.0.2.7")),
                2: UnitAccess(units[2], Requester(None, "192.0.2.7")),
            }
        )
        request = encode(1, 7, bytes.fromhex("03 0064 0001"))
        session.buffer.data[: len(request)] = request
        return session.received(len(request), NOW)

    assert ask(PLC)[7:] == bytes((0x83, 0x0B))
    assert texts(first) == ["plc asked unit 7; units here: 1, 2"]
    assert texts(second) == []
    ask(None)
    assert texts(second) == ["undeclared peer 192.0.2.7 asked unit 7; units here: 1, 2"]


def test_a_read_that_is_served_leaves_no_trace(cell: Cell, unit: Unit) -> None:
    for pdu in ("03 0064 0004", "03 ea60 0010", "01 0000 0008", "06 000a 0001"):
        execute(unit, Requester(PLC), bytes.fromhex(pdu), NOW)
    assert sum(cell.health.unserved.values()) == 0


@st.composite
def requests(draw: st.DrawFn) -> bytes:
    """Requests of every served function, most of them nearly right."""
    function = draw(st.sampled_from((1, 2, 3, 4, 5, 6, 15, 16, 22, 23)))
    word = st.one_of(st.sampled_from((0, 1, 2, 10, 100, 121, 122, 123, 124, 125, 126, 2000, 2001)), _WORDS)
    pdu = bytearray(struct.pack(">BHH", function, draw(_WORDS), draw(st.one_of(word, st.just(0xFF00)))))
    if function in (15, 16):
        count = int.from_bytes(pdu[3:5], "big")
        size = 2 * count if function == 16 else (count + 7) // 8
        pdu += bytes([size & 0xFF]) + bytes(min(size, 246))
    elif function == 22:
        pdu += struct.pack(">H", draw(_WORDS))
    elif function == 23:
        count = draw(word)
        pdu += struct.pack(">HHB", draw(_WORDS), count, 2 * count & 0xFF) + bytes(min(2 * count, 240))
    for _change in range(draw(st.integers(0, 2))):
        position = draw(st.integers(1, len(pdu)))
        pdu[position : position + draw(st.integers(0, 1))] = draw(st.binary(max_size=1))
    return bytes(pdu[:253])


_WORDS = st.integers(0, 0xFFFF)


@given(st.one_of(requests(), st.binary(min_size=1, max_size=253)))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@example(bytes.fromhex("05 000a 0001"))
@example(bytes.fromhex("0f 0000 0009 01 ff"))
@example(bytes.fromhex("17 0064 0001 000a 0001 02 00"))
def test_what_is_wrong_in_words_is_what_is_answered_with_03_before_anything_is_looked_up(
    cell: Cell, unit: Unit, pdu: bytes
) -> None:
    """`modbus.describe.fault` words what the functions check by themselves: neither may know more than the other."""
    before = cell.health.unserved[Unserved.MALFORMED]
    accepted, refused = cell.health.writes_accepted, cell.health.writes_refused
    answer = execute(unit, Requester(PLC), pdu, NOW)
    malformed = cell.health.unserved[Unserved.MALFORMED] > before
    if pdu[0] not in (1, 2, 3, 4, 5, 6, 15, 16, 22, 23):
        assert fault(pdu) == ""
        return
    assert malformed == bool(fault(pdu)), "what is said"
    if malformed:
        assert answer == bytes((pdu[0] | 0x80, 3))
        assert (cell.health.writes_accepted, cell.health.writes_refused) == (accepted, refused)
    elif answer == bytes((pdu[0] | 0x80, 3)):
        assert cell.health.writes_refused == refused + 1, "the cell has said why"
