"""What waited in the sockets while the gateway stood still, over real sockets.

A test that sends and reports the gap without awaiting anything in between is the process that stood still: nothing
was served meanwhile, and the listener hears of the gap first, as the clock makes it.
"""

from __future__ import annotations

import asyncio
import fcntl
import socket
import struct
import termios
import time
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import ExitStack

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server import listener as server
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent, PeerEventKind
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.waiting import SETTLING
from gatewayd.loop import clock
from gatewayd.modbus.frames import BUFFER_SIZE
from tests.links.modbus_server.conftest import PLC, bring_up

PlanOf = Callable[..., ModbusPlan]

WRITE, READ_AND_WRITE, READ = "06 000a 0005", "17 000a 0001 000a 0001 02 0007", "03 000a 0001"
LOCK = "06 ea88 0004"
"""Request of the lock of `part`."""
DONE = {WRITE: WRITE, READ_AND_WRITE: "17 02 0007", READ: "03 02 0000"}
BUSY = {WRITE: "86 06", READ_AND_WRITE: "97 06", READ: "03 02 0000"}
GAP = 5.0
LIMIT = 0.5
"""Seconds that a write of this file's cell may have waited."""


class Judge(Cell):
    """Records who wrote and who was seen, and refuses what waited too long."""

    def __init__(self, definition: CellDefinition) -> None:
        super().__init__(definition)
        self.waits: list[float] = []
        self.seen: list[float] = []

    def write(self, requester: Requester, changes: Sequence[Change], now: float) -> Refusal | None:
        self.waits.append(requester.waited)
        if requester.waited > LIMIT:
            return Refusal(Reason.WAITED, changes[0].variable)
        return super().write(requester, changes, now)

    def writer_seen(
        self, requester: Requester, now: float, *, wrote: bool = False, owns: bool = False
    ) -> None:
        self.seen.append(requester.waited)
        super().writer_seen(requester, now, wrote=wrote, owns=owns)


@pytest.fixture
def judge(live_cell: Cell) -> Judge:
    judge = Judge(live_cell.definition)
    bring_up(judge, time.monotonic())
    judge.freshness.stale_after = 3600.0
    return judge


@pytest.fixture
async def listener(judge: Judge, plan_of: PlanOf, events: list[PeerEvent]) -> AsyncIterator[ModbusListener]:
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(), judge)])
    await listener.start()
    yield listener
    await listener.close()


@pytest.fixture
def peers() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


class Peer:
    """A client whose sending never lets the loop run."""

    def __init__(self, peers: ExitStack, listener: ModbusListener, source: str = "127.0.0.2") -> None:
        address = ("127.0.0.1", listener.port)
        self.socket = peers.enter_context(socket.create_connection(address, 5, (source, 0)))
        self._received = bytearray()

    def send(self, *pdus: str) -> None:
        bodies = [bytes.fromhex(pdu) for pdu in pdus]
        self.deliver(b"".join(struct.pack(">HHHB", 1, 0, len(body) + 1, 1) + body for body in bodies))

    def deliver(self, data: bytes) -> None:
        """Send it; on return the other side's system has it."""
        self.socket.sendall(data)
        while any(fcntl.ioctl(self.socket, termios.TIOCOUTQ, bytes(4))):
            time.sleep(0.001)

    async def answer(self) -> str:
        """The next one; "" if the connection has ended."""
        self.socket.setblocking(False)
        while len(self._received) < 7 or len(self._received) < 6 + self._received[5]:
            async with asyncio.timeout(5):
                found = await asyncio.get_running_loop().sock_recv(self.socket, 4096)
            if not found:
                return ""
            self._received += found
        end = 6 + self._received[5]
        answer, self._received = bytes(self._received[7:end]), self._received[end:]
        return answer.hex(" ")

    async def ask(self, pdu: str) -> str:
        self.socket.setblocking(True)
        self.send(pdu)
        return await self.answer()


def same(answer: str, pdu: str) -> bool:
    return bytes.fromhex(answer) == bytes.fromhex(pdu)


def stand_still(listener: ModbusListener, seconds: float = GAP) -> None:
    now = time.monotonic()
    listener.gap(now - seconds, now)


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - conditions of others have no event
            await asyncio.sleep(0.001)


async def settled() -> None:
    await asyncio.sleep(2 * SETTLING)


@pytest.mark.parametrize("pdu", [WRITE, READ_AND_WRITE])
async def test_a_write_that_waited_says_so_and_the_next_does_not(
    listener: ModbusListener, judge: Judge, peers: ExitStack, pdu: str
) -> None:
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    peer.send(pdu)
    stand_still(listener)
    assert same(await peer.answer(), BUSY[pdu])
    assert judge.waits[0] == pytest.approx(GAP, abs=0.5)
    await settled()
    assert same(await peer.ask(pdu), DONE[pdu])
    assert judge.waits[1] == 0.0


async def test_a_write_after_the_gap_did_not_wait(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    """Its connection was silent, and its socket empty, when the gap ended."""
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    stand_still(listener)
    await settled()
    assert same(await peer.ask(WRITE), WRITE)
    assert judge.waits == [0.0]


async def test_a_write_that_comes_right_after_the_gap_may_have_waited_elsewhere(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    soon = time.monotonic() + 1.0
    listener.gap(soon - GAP, soon)
    peer.send(WRITE)
    await peer.answer()
    assert judge.waits[0] > LIMIT


async def test_everything_that_waited_is_marked_however_much_it_was(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    count = 3 * BUFFER_SIZE // 12
    peer.send(*[WRITE] * count)
    stand_still(listener)
    assert [await peer.answer() for _ in range(count)] == ["86 06"] * count
    assert min(judge.waits) >= GAP
    await settled()
    assert same(await peer.ask(WRITE), WRITE)


async def test_a_request_whose_first_part_waited_did_wait(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    """Whether that part was still in the socket or was read already."""
    early, late = Peer(peers, listener), Peer(peers, listener)
    frame = bytes.fromhex("0001 0000 0006 01" + WRITE)
    early.deliver(frame[:5])
    assert same(await late.ask(READ), DONE[READ])
    await settled()
    late.socket.setblocking(True)
    late.deliver(frame[:5])
    stand_still(listener)
    await settled()
    for peer in (early, late):
        peer.socket.sendall(frame[5:])
        assert await peer.answer() == "86 06"
    assert min(judge.waits) >= GAP


async def test_reads_that_waited_are_answered_and_their_sign_of_life_is_marked(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    judge.seen.clear()
    peer.send(READ, "01 0000 0008")
    stand_still(listener)
    assert same(await peer.answer(), DONE[READ])
    assert same(await peer.answer(), "01 01 00")
    assert len(judge.seen) == 2
    assert min(judge.seen) >= GAP


async def test_a_short_gap_is_handed_on_as_what_it_was(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    peer.send(WRITE)
    stand_still(listener, 0.1)
    assert same(await peer.answer(), WRITE)
    assert 0.1 <= judge.waits[0] < LIMIT


async def test_two_gaps_add_up_for_what_was_not_read_between_them(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    peer = Peer(peers, listener)
    assert same(await peer.ask(READ), DONE[READ])
    peer.send(WRITE)
    now = time.monotonic()
    listener.gap(now - 0.8, now - 0.4)
    listener.gap(now - 0.3, now)
    assert await peer.answer() == "86 06"
    assert judge.waits[0] >= 0.8


async def test_a_connection_that_waited_for_its_acceptance_waited_with_what_it_sent(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    peer = Peer(peers, listener)
    peer.send(WRITE)
    stand_still(listener)
    assert await peer.answer() == "86 06"
    assert judge.waits[0] >= GAP
    await settled()
    assert same(await peer.ask(WRITE), WRITE)


async def test_a_connection_made_after_the_gap_did_not_wait(
    listener: ModbusListener, judge: Judge, peers: ExitStack
) -> None:
    stand_still(listener)
    await settled()
    await settled()
    peer = Peer(peers, listener)
    assert same(await peer.ask(WRITE), WRITE)
    assert judge.waits == [0.0]


@pytest.mark.parametrize("end", ["closed", "half-closed", "reset"])
async def test_a_waiting_write_is_refused_before_the_end_behind_it(
    listener: ModbusListener, judge: Judge, peers: ExitStack, events: list[PeerEvent], end: str
) -> None:
    """Whether a kernel keeps what came before a reset is its own affair."""
    peer = Peer(peers, listener)
    assert same(await peer.ask(WRITE), WRITE)
    judge.waits.clear()
    peer.send(WRITE)
    if end == "half-closed":
        peer.socket.shutdown(socket.SHUT_WR)
    else:
        linger = struct.pack("ii", end == "reset", 0)
        peer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        peer.socket.close()
    stand_still(listener)
    await until(lambda: any(event.kind is PeerEventKind.DISCONNECTED for event in events))
    assert all(wait >= GAP for wait in judge.waits)
    assert len(judge.waits) == 1 or end == "reset"
    assert judge.writers.connections[PLC] == 0
    assert not judge.ownership.held_by(PLC)


async def test_the_time_of_the_gap_is_no_silence_of_the_peer(
    judge: Judge,
    plan_of: PlanOf,
    peers: ExitStack,
    events: list[PeerEvent],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Neither for the idle time-out nor for answers that it did not read."""
    monkeypatch.setattr(server, "_SWEEP", 0.01)
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(idle_timeout=3.0), judge)])
    await listener.start()
    idle, slow = Peer(peers, listener), Peer(peers, listener)
    assert same(await idle.ask(READ), DONE[READ])
    slow.socket.setblocking(False)
    requests = bytes.fromhex("0001 0000 0006 01 03 00c8 0060") * 100_000
    sending = asyncio.create_task(asyncio.get_running_loop().sock_sendall(slow.socket, requests))
    await until(lambda: any(one.stalled_since is not None for one in listener._connections))
    (stalled,) = [one for one in listener._connections if one.stalled_since is not None]
    for connection in listener._connections:
        connection.last_request -= 60.0
    stalled.stalled_since = time.monotonic() - 60.0
    stand_still(listener, 60.0)
    await asyncio.sleep(0.1)
    assert [event.kind for event in events] == [PeerEventKind.CONNECTED] * 2
    sending.cancel()
    await listener.close()


@pytest.mark.parametrize("together", [True, False], ids=["one connection", "two connections"])
def test_stopped_between_two_requests_of_one_turn_the_second_has_waited(
    judge: Judge, plan_of: PlanOf, peers: ExitStack, together: bool
) -> None:
    def stopped(_direction: Direction) -> None:
        if len(judge.waits) == 1:
            time.sleep(LIMIT + 0.1)

    async def main() -> list[str]:
        listener = ModbusListener("127.0.0.1", 0)
        listener.serve([(plan_of(), judge)])
        await listener.start()
        clock.on_gap(lambda gap: listener.gap(gap.since, gap.until))
        first = Peer(peers, listener)
        second = first if together else Peer(peers, listener)
        for peer in (first, second):
            await peer.ask(READ)
            peer.socket.setblocking(True)
        judge.listeners.append(stopped)
        if together:
            first.send(WRITE, WRITE)
        else:
            first.send(WRITE)
            second.send(WRITE)
        answers = [await first.answer(), await second.answer()]
        await listener.close()
        return answers

    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        answers = runner.run(main())
    assert sorted(answers) == sorted([WRITE.replace(" 000a 0005", " 00 0a 00 05"), BUSY[WRITE]])
    in_time, late = judge.waits
    assert in_time < LIMIT < late
