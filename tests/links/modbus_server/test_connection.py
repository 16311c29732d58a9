"""Connections at their edges: before they are served, at their end, and when the system has run out of something."""

from __future__ import annotations

import asyncio
import os
import resource
import socket
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from typing import Any

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Passage
from gatewayd.links.modbus_server import limits
from gatewayd.links.modbus_server import listener as server
from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent, PeerEventKind
from gatewayd.links.modbus_server.plan import ModbusPlan

PlanOf = Callable[..., ModbusPlan]

READ = bytes.fromhex("0001 0000 0006 01 03 0000 0001")
ANSWER = bytes.fromhex("0001 0000 0005 01 03 02 0000")
WRITE = bytes.fromhex("0001 0000 0006 01 06 000a 0005")
MANY = 1024
"""As many connections as a mapping may allow."""


async def until(condition: Callable[[], bool], seconds: float = 5) -> None:
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110 - conditions of others have no event
            await asyncio.sleep(0.005)


@pytest.fixture
def sockets() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def dial(listener: ModbusListener, sockets: ExitStack) -> Callable[..., socket.socket]:
    """Connects and sends without letting the loop run: whatever comes first is in the socket with the connection."""

    def dial(data: bytes = b"", source: str = "127.0.0.2") -> socket.socket:
        peer = socket.create_connection(("127.0.0.1", listener.port), 5, (source, 0))
        sockets.enter_context(peer).sendall(data)
        peer.setblocking(False)
        return peer

    return dial


async def received(peer: socket.socket, count: int) -> bytes:
    """As many bytes, or those before the end or the reset of the connection."""
    found = b""
    with suppress(ConnectionError):
        async with asyncio.timeout(5):
            while len(found) < count:
                data = await asyncio.get_running_loop().sock_recv(peer, count - len(found))
                if not data:
                    break
                found += data
    return found


def read_in_spite_of_a_pause(
    transport: Any, descriptor: int, callback: Callable[..., None], *args: Any
) -> None:
    if not transport.is_closing():
        transport._loop._add_reader(descriptor, callback, *args)


@pytest.mark.parametrize("old", [False, True], ids=["this asyncio", "asyncio of Python 3.11.2"])
async def test_what_comes_with_the_connection_is_answered_by_the_poller(
    dial: Callable[..., socket.socket], listener: ModbusListener, monkeypatch: pytest.MonkeyPatch, old: bool
) -> None:
    """Python 3.11.2 starts to read after `connection_made`, whatever that said of pausing."""
    if old:
        monkeypatch.setattr(
            "asyncio.selector_events._SelectorTransport._add_reader", read_in_spite_of_a_pause
        )
    peers = [dial(READ), dial(READ * 100), dial(READ[:5]), dial()]
    assert await received(peers[0], len(ANSWER)) == ANSWER
    assert await received(peers[1], 100 * len(ANSWER)) == ANSWER * 100
    peers[2].send(READ[5:])
    peers[3].send(READ)
    assert await received(peers[2], len(ANSWER)) == ANSWER
    assert await received(peers[3], len(ANSWER)) == ANSWER
    watched = asyncio.get_running_loop()._selector.get_map()  # type: ignore[attr-defined]
    assert len(listener._connections) == len(peers)
    assert not {connection.descriptor for connection in listener._connections} & set(watched)


@pytest.mark.parametrize(
    "beginning", [b"", READ[:3], READ[:11]], ids=["nothing", "half a head", "half a PDU"]
)
async def test_a_connection_that_ends_before_its_request_leaves_nothing(
    dial: Callable[..., socket.socket], listener: ModbusListener, events: list[PeerEvent], beginning: bytes
) -> None:
    peer = dial(beginning)
    peer.shutdown(socket.SHUT_WR)
    assert await received(peer, 1) == b""
    assert [(event.kind, event.reason) for event in events] == [
        (PeerEventKind.CONNECTED, ""),
        (PeerEventKind.DISCONNECTED, "closed by the peer"),
    ]
    assert listener.connections == 0


async def test_a_reset_before_the_acceptance_is_none_of_our_business(
    dial: Callable[..., socket.socket], listener: ModbusListener, live_cell: Cell
) -> None:
    gone = [dial(WRITE) for _ in range(5)]
    for peer in gone:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        peer.close()
    assert await received(dial(READ), len(ANSWER)) == ANSWER
    await until(lambda: listener.connections == 1)
    assert live_cell.writers.connections == [1, 0]
    assert not live_cell.ownership.held_by(0)


async def test_what_was_not_read_before_closing_is_never_carried_out(
    dial: Callable[..., socket.socket], listener: ModbusListener, live_cell: Cell, events: list[PeerEvent]
) -> None:
    """Neither on a connection, nor on one that waits for its acceptance, nor on what comes after."""
    served = dial(READ)
    assert await received(served, len(ANSWER)) == ANSWER
    served.send(WRITE)
    waiting = dial(WRITE)
    await listener.close()
    with suppress(ConnectionError):
        served.send(WRITE)
    assert await received(served, 1) == b""
    assert await received(waiting, 1) == b""
    await asyncio.sleep(0.02)
    assert not live_cell.ownership.held_by(0)
    assert [event.kind for event in events] == [PeerEventKind.CONNECTED, PeerEventKind.DISCONNECTED]


@pytest.mark.parametrize("turns", range(6))
async def test_who_is_accepted_in_the_moment_of_closing_is_cut_off(
    dial: Callable[..., socket.socket], listener: ModbusListener, events: list[PeerEvent], turns: int
) -> None:
    """Acceptance takes some turns of the loop; closing may come in each of them."""
    peer = dial(READ)
    for _ in range(turns):
        await asyncio.sleep(0)
    await listener.close()
    assert await received(peer, len(ANSWER)) in {b"", ANSWER}
    assert await received(peer, 1) == b""
    assert listener.connections == 0
    assert {event.kind for event in events} <= {PeerEventKind.CONNECTED, PeerEventKind.DISCONNECTED}


async def test_a_slow_reader_gets_all_answers_before_its_half_close(
    listener: ModbusListener,
) -> None:
    peer = socket.socket()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    peer.setblocking(False)
    loop = asyncio.get_running_loop()
    await loop.sock_connect(peer, ("127.0.0.1", listener.port))
    request, size = bytes.fromhex("0001 0000 0006 01 03 00c8 0060"), 9 + 192
    await loop.sock_sendall(peer, request * 3000)
    peer.shutdown(socket.SHUT_WR)
    found = 0
    while data := await loop.sock_recv(peer, 16384):
        found += len(data)
        await asyncio.sleep(0)
    assert found == 3000 * size
    assert listener.connections == 0
    peer.close()


async def test_a_half_closed_peer_that_does_not_read_is_dropped_as_any_other(
    listener: ModbusListener, monkeypatch: pytest.MonkeyPatch, events: list[PeerEvent]
) -> None:
    monkeypatch.setattr(limits, "STALLED_AFTER", 0.1)
    monkeypatch.setattr(server, "_SWEEP", 0.02)
    peer = socket.socket()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    peer.setblocking(False)
    loop = asyncio.get_running_loop()
    await loop.sock_connect(peer, ("127.0.0.1", listener.port))
    sent = 0
    with suppress(BlockingIOError):
        while True:
            sent += peer.send(bytes.fromhex("0001 0000 0006 01 03 00c8 0060") * 500)
            await asyncio.sleep(0)
    peer.shutdown(socket.SHUT_WR)
    await until(lambda: len(events) == 2)
    assert events[-1].reason == "did not read its answers for 0.1 s"
    assert sent
    peer.close()


async def test_as_many_connections_as_a_mapping_may_allow(
    listener: ModbusListener,
    dial: Callable[..., socket.socket],
    live_cell: Cell,
    plan_of: PlanOf,
    events: list[PeerEvent],
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = 2 * MANY + 200
    if hard < needed:
        pytest.skip(f"needs {needed} file descriptors")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, needed), hard))
    try:
        listener.serve([(replace(plan_of(connections=MANY), connections_per_peer=MANY), live_cell)])
        peers = []
        for number in range(MANY):
            peers.append(dial(READ, f"127.0.0.{1 + number % 3}"))
            if number % 50 == 0:  # a backlog is shorter than that
                await until(lambda: listener.connections == len(peers))
        for peer in peers:
            assert await received(peer, len(ANSWER)) == ANSWER
        assert listener.connections == MANY
        assert live_cell.writers.connections == [len(range(place, MANY, 3)) for place in (1, 2)]
        assert await received(dial(READ, "127.0.0.1"), 1) == b""
        assert events[-1].kind is PeerEventKind.FULL
        for peer in peers:
            peer.send(READ)
        for peer in peers:
            assert await received(peer, len(ANSWER)) == ANSWER
        begin = time.monotonic()
        await listener.close()
        assert time.monotonic() - begin < 1.0
        assert live_cell.writers.connections == [0, 0]
        assert await received(peers[-1], 1) == b""
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


async def test_without_file_descriptors_those_who_are_there_are_served_and_the_others_later(
    listener: ModbusListener, dial: Callable[..., socket.socket], sockets: ExitStack
) -> None:
    """And the processor is not spent on trying."""
    present = dial(READ)
    assert await received(present, len(ANSWER)) == ANSWER
    late = sockets.enter_context(socket.socket())
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    taken: list[int] = []
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(soft, 1024), hard))
        with suppress(OSError):
            while True:
                taken.append(os.dup(0))
        late.connect(("127.0.0.1", listener.port))
        late.sendall(READ)
        late.setblocking(False)
        begin, spent = time.monotonic(), time.process_time()
        while time.monotonic() - begin < 0.5:
            present.send(READ)
            assert await received(present, len(ANSWER)) == ANSWER
            await asyncio.sleep(0.02)
        assert time.process_time() - spent < 0.25
        assert listener.listening
        assert listener.connections == 1
    finally:
        for descriptor in taken:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert await received(late, len(ANSWER)) == ANSWER
    assert listener.connections == 2


async def test_an_ipv6_address_is_for_ipv6_peers_alone(live_cell: Cell, plan_of: PlanOf) -> None:
    """The wildcard `::` too: whoever wants both protocols has a listener on each."""
    listener = ModbusListener("::", 0)
    listener.serve([(plan_of(), live_cell)])
    try:
        await listener.start()
    except ListenError:
        pytest.skip("this machine has no IPv6")
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection("127.0.0.1", listener.port)
    reader, writer = await asyncio.open_connection("::1", listener.port)
    writer.write(READ)
    assert await reader.readexactly(len(ANSWER)) == ANSWER
    writer.close()
    await listener.close()


async def test_what_passes_is_handed_to_a_tap_while_there_is_one(listener: ModbusListener) -> None:
    """Whole frames, however they come in; without a tap nothing stands between socket and session."""
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)

    async def exchange(data: bytes) -> None:
        writer.write(data[:5])
        await writer.drain()
        writer.write(data[5:])
        assert await reader.readexactly(len(ANSWER)) == ANSWER

    await exchange(READ)
    (connection,) = listener._connections
    assert connection.receive == connection.session.received
    passed: list[Passage] = []
    listener.trace(passed.append)
    await exchange(READ)
    own, peer = writer.get_extra_info("peername"), writer.get_extra_info("sockname")
    ends = f"{peer[0]}:{peer[1]}", f"{own[0]}:{own[1]}"
    assert [(one.data, one.outgoing) for one in passed] == [(READ, False), (ANSWER, True)]
    assert {(one.peer, one.own, one.cell) for one in passed} == {(*ends, "press-3")}
    later_reader, later = await asyncio.open_connection("127.0.0.1", listener.port)
    later.write(READ)
    await later_reader.readexactly(len(ANSWER))
    assert len(passed) == 4, "who connects later is traced as well"
    listener.trace(None)
    await exchange(READ)
    assert len(passed) == 4
    assert connection.receive == connection.session.received
    for stream in (writer, later):
        stream.close()


async def test_a_request_that_waits_for_its_turn_passes_the_tap_once(listener: ModbusListener) -> None:
    """More requests than one turn serves; what is no Modbus passes as it is."""
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)
    passed: list[Passage] = []
    listener.trace(passed.append)
    requests = [number.to_bytes(2, "big") + READ[2:] for number in range(30)]
    writer.write(b"".join(requests))
    await reader.readexactly(30 * len(ANSWER))
    assert [passage.data for passage in passed if not passage.outgoing] == requests
    assert len([passage for passage in passed if passage.outgoing]) == 30
    writer.write(b"GET / HTTP/1.1\r\n\r\n")
    assert await reader.read() == b""
    assert [passage.data for passage in passed][60:] == [b"GET / HTTP/1.1\r\n\r\n"]
    writer.close()
