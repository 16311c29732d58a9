"""Real sockets: who is let in, who is shown out, and what is left behind."""

from __future__ import annotations

import asyncio
import errno
import resource
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from itertools import islice, pairwise

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server import limits, session, shares
from gatewayd.links.modbus_server import listener as server
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent, PeerEventKind
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.modbus.frames import BUFFER_SIZE, MAX_FRAME

Ask = Callable[..., Awaitable[str]]
PlanOf = Callable[..., ModbusPlan]

READ = bytes.fromhex("0001 0000 0006 01 03 0000 0001")
ANSWER = bytes.fromhex("0001 0000 0005 01 03 02 0000")


@pytest.fixture
def sockets() -> Iterator[ExitStack]:
    """Closed after the test."""
    with ExitStack() as sockets:
        yield sockets


async def dial(
    listener: ModbusListener, source: str = "127.0.0.1"
) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    return await asyncio.open_connection("127.0.0.1", listener.port, local_addr=(source, 0))


async def is_served(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
    try:
        writer.write(READ)
        return await reader.readexactly(len(ANSWER)) == ANSWER
    except (ConnectionError, asyncio.IncompleteReadError):
        return False


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - conditions of others have no event
            await asyncio.sleep(0.005)


async def test_a_port_that_is_taken_is_reported_with_a_remedy(listener: ModbusListener) -> None:
    second = ModbusListener("127.0.0.1", listener.port)
    with pytest.raises(ListenError) as raised:
        await second.start()
    assert raised.value.errno == errno.EADDRINUSE
    assert f"cannot listen on 127.0.0.1:{listener.port}" in str(raised.value)
    assert "another program listens there" in str(raised.value)
    await second.close()


async def test_the_wildcards_of_both_families_share_a_port() -> None:
    """So `[::]` has IPv6 peers alone: rules GW207 and GW219 say so."""
    everywhere = ModbusListener("0.0.0.0", 0)
    await everywhere.start()
    beside = ModbusListener("::", everywhere.port)
    try:
        await beside.start()
        assert beside.listening
    finally:
        await beside.close()
        await everywhere.close()


async def test_an_address_of_another_machine_is_reported_with_a_remedy() -> None:
    listener = ModbusListener("203.0.113.1", 0)
    with pytest.raises(ListenError, match="no such address"):
        await listener.start()


async def test_can_start_once_the_port_is_free(listener: ModbusListener) -> None:
    second = ModbusListener("127.0.0.1", listener.port)
    with pytest.raises(ListenError):
        await second.start()
    await listener.close()
    await second.start()
    await second.close()


async def test_closing_is_quick_and_ends_every_connection(
    listener: ModbusListener, live_cell: Cell, events: list[PeerEvent]
) -> None:
    streams = [await dial(listener, "127.0.0.2") for _ in range(3)]
    for reader, writer in streams:
        assert await is_served(reader, writer)
    begin = time.monotonic()
    await listener.close()
    assert time.monotonic() - begin < 0.5
    for reader, writer in streams:
        assert not await is_served(reader, writer)
        writer.close()
    assert events[-1].reason == "gateway stopped"
    assert live_cell.writers.connections == [0, 0]
    assert not live_cell.listeners


async def test_reports_who_comes_and_goes(
    listener: ModbusListener, events: list[PeerEvent], live_cell: Cell
) -> None:
    reader, writer = await dial(listener, "127.0.0.3")
    port = writer.get_extra_info("sockname")[1]
    assert await is_served(reader, writer)
    assert live_cell.health.words["modbus_connections"] == 1
    writer.close()
    await until(lambda: len(events) == 2)
    assert events == [
        PeerEvent(PeerEventKind.CONNECTED, f"127.0.0.3:{port}", ("hmi",)),
        PeerEvent(PeerEventKind.DISCONNECTED, f"127.0.0.3:{port}", ("hmi",), "closed by the peer"),
    ]
    assert live_cell.health.words["modbus_connections"] == 0


async def test_a_reset_by_the_peer_releases_what_it_owned(
    listener: ModbusListener, ask: Ask, live_cell: Cell
) -> None:
    reader, writer = await dial(listener, "127.0.0.2")
    writer.write(bytes.fromhex("0001 0000 0006 01 06 000a 0005"))
    await reader.readexactly(12)
    assert live_cell.ownership.held_by(0)
    writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()
    await until(lambda: not live_cell.ownership.held_by(0))
    assert await ask("03 000a 0001", "127.0.0.3") == "03 02 00 00", "the fallback"


async def test_the_last_connection_of_a_writer_counts(listener: ModbusListener, live_cell: Cell) -> None:
    (first_reader, first), (second_reader, second) = (
        await dial(listener, "127.0.0.2"),
        await dial(listener, "127.0.0.2"),
    )
    assert await is_served(first_reader, first)
    assert await is_served(second_reader, second)
    assert live_cell.writers.connections[0] == 2
    first.close()
    await until(lambda: live_cell.writers.connections[0] == 1)
    assert live_cell.writers.alive[0]
    second.close()
    await until(lambda: not live_cell.writers.alive[0])


async def test_who_is_not_on_the_access_list_is_cut_off(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]
) -> None:
    listener.serve([(plan_of(allow=("127.0.0.2/31",)), live_cell)])
    for source, served in (("127.0.0.1", False), ("127.0.0.2", True), ("127.0.0.3", True)):
        reader, writer = await dial(listener, source)
        assert await is_served(reader, writer) is served
        writer.close()
    assert events[0].kind is PeerEventKind.DENIED


async def test_a_full_listener_refuses(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]
) -> None:
    """Two of four places are those of the writers."""
    listener.serve([(plan_of(connections=4), live_cell)])
    streams = [await dial(listener) for _ in range(3)]
    assert [await is_served(*stream) for stream in streams] == [True, True, False]
    assert events[-1].kind is PeerEventKind.FULL
    assert listener.refusals == {"denied": 0, "full": 1, "crowded": 0}
    for _reader, writer in streams:
        writer.close()


async def test_a_reader_with_many_connections_keeps_no_writer_out(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]
) -> None:
    """Nor another reader: beyond its share it is refused, and reported once."""
    listener.serve([(plan_of(), live_cell)])
    greedy = [await dial(listener) for _ in range(40)]
    assert [await is_served(*stream) for stream in greedy] == [True] * 16 + [False] * 24
    others = [await dial(listener, source) for source in ("127.0.0.2", "127.0.0.3", "127.0.0.4")]
    assert [await is_served(*stream) for stream in others] == [True] * 3
    crowded = [event for event in events if event.kind is PeerEventKind.CROWDED]
    assert [(event.reason, event.writers, event.repeats) for event in crowded] == [
        ("too many connections of one peer", (), 0)
    ]
    await listener.close()
    assert PeerEvent(PeerEventKind.CROWDED, "127.0.0.1", repeats=23) in events
    for _reader, writer in (*greedy, *others):
        writer.close()


async def test_a_reader_that_floods_keeps_no_writer_waiting(
    listener: ModbusListener, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that its connections sent at once took its time, hundreds of milliseconds, before anybody else had a turn."""
    requests = bytes.fromhex("0001 0000 0006 01 03 f320 007d") * 80
    answered: list[bytes] = []

    def counted(unit: Unit, requester: Requester, pdu: bytes, now: float) -> bytes:
        answered.append(pdu)
        return execute(unit, requester, pdu, now)

    monkeypatch.setattr(session, "execute", counted)
    floods = [await dial(listener) for _ in range(8)]
    plc = await dial(listener, "127.0.0.2")
    assert await is_served(*plc)
    for _reader, flood in floods:
        flood.write(requests)
    assert await is_served(*plc)
    assert len(answered) < 320
    for reader, flood in floods:
        assert len(await reader.readexactly(80 * (9 + 250))) > 0
        flood.close()
    plc[1].close()


async def test_a_writer_that_is_declared_later_takes_the_place_of_the_reader_unused_longest(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]
) -> None:
    plan = plan_of(connections=4)
    listener.serve([(replace(plan, writers=()), live_cell)])
    readers = [await dial(listener) for _ in range(4)]
    assert [await is_served(*stream) for stream in readers[1:] + readers[:1]] == [True] * 4
    listener.serve([(plan, live_cell)])
    writer = await dial(listener, "127.0.0.2")
    assert await is_served(*writer)
    assert [await is_served(*stream) for stream in readers] == [True, False, True, True]
    assert "made room for 127.0.0.2" in [event.reason for event in events]
    for _reader, stream in (*readers, writer):
        stream.close()


async def test_a_full_listener_closes_the_connection_that_was_unused_longest(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But none that owns anything."""
    monkeypatch.setattr(shares, "UNUSED_AFTER", 0.0)
    listener.serve([(plan_of(connections=4), live_cell)])
    owner = await dial(listener, "127.0.0.2")
    owner[1].write(bytes.fromhex("0001 0000 0006 01 06 000a 0005"))
    await owner[0].readexactly(12)
    oldest, other = await dial(listener), await dial(listener)
    assert [await is_served(*stream) for stream in (oldest, other)] == [True, True]
    newest = await dial(listener)
    assert await is_served(*newest)
    assert not await is_served(*oldest)
    assert await is_served(*other)
    assert await is_served(*owner)
    assert listener.connections == 3, "the fourth is kept for the other writer"
    for _reader, writer in (owner, oldest, other, newest):
        writer.close()


async def test_many_connections_at_once_are_accepted_by_and_by(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, sockets: ExitStack
) -> None:
    """They wait in the kernel meanwhile, and requests are served between them."""
    listener.serve([(replace(plan_of(connections=128), connections_per_peer=128), live_cell)])
    waiting = [
        sockets.enter_context(socket.create_connection(("127.0.0.1", listener.port), timeout=0.5))
        for _ in range(100)
    ]
    accepted = [0]
    while accepted[-1] < len(waiting):
        await asyncio.sleep(0)
        accepted.append(listener.connections)
    assert max(later - earlier for earlier, later in pairwise(accepted)) < 20


async def test_a_peer_that_comes_and_goes_is_served_and_reported_in_few_lines(
    listener: ModbusListener, events: list[PeerEvent]
) -> None:
    for _ in range(100):
        reader, writer = await dial(listener)
        assert await is_served(reader, writer)
        writer.close()
    await until(lambda: not listener.connections)
    await listener.close()
    kinds = [(event.kind, event.repeats) for event in events]
    for kind in (PeerEventKind.CONNECTED, PeerEventKind.DISCONNECTED):
        assert kinds.count((kind, 0)) == 10
        assert kinds.count((kind, 90)) == 1
    assert len(kinds) == 22


async def test_a_connection_without_requests_is_closed(
    live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]
) -> None:
    """Bytes that never become a request are none."""
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(idle_timeout=0.2), live_cell)])
    await listener.start()
    idle, dripping, busy = [await dial(listener) for _ in range(3)]
    begin = time.monotonic()
    drops = iter(READ[:5])
    while time.monotonic() - begin < 0.5:
        assert await is_served(*busy)
        dripping[1].write(bytes(islice(drops, 1)))
        await asyncio.sleep(0.03)
    assert await idle[0].read() == b""
    assert await dripping[0].read() == b""
    assert [event.reason for event in events if event.kind is PeerEventKind.DISCONNECTED] == [
        "no request for 0.2 s"
    ] * 2
    for _reader, writer in (idle, dripping, busy):
        writer.close()
    await listener.close()


async def test_a_connection_that_holds_a_lock_is_not_closed_for_idleness(
    live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]
) -> None:
    """That would be a hidden release; what silence of a writer means is said by its `timeout`."""
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(idle_timeout=0.1), live_cell)])
    await listener.start()
    owner, other = await dial(listener, "127.0.0.2"), await dial(listener)
    owner[1].write(bytes.fromhex("0001 0000 0006 01 06 000a 0005"))
    await owner[0].readexactly(12)
    assert await other[0].read() == b""
    await asyncio.sleep(0.2)
    assert live_cell.ownership.held_by(0)
    assert listener.connections == 1
    owner[1].write(bytes.fromhex("0001 0000 0006 01 06 ea89 ffff"))
    await owner[0].readexactly(12)
    assert await owner[0].read() == b"", "released, it is like any other"
    for _reader, writer in (owner, other):
        writer.close()
    await listener.close()


async def test_an_owner_that_does_not_read_its_answers_is_dropped_with_its_locks(
    live_cell: Cell, plan_of: PlanOf, monkeypatch: pytest.MonkeyPatch, events: list[PeerEvent]
) -> None:
    monkeypatch.setattr(limits, "STALLED_AFTER", 0.1)
    monkeypatch.setattr(server, "_SWEEP", 0.02)
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(), live_cell)])
    await listener.start()
    peer = socket.create_connection(("127.0.0.1", listener.port), 5, ("127.0.0.2", 0))
    peer.setblocking(False)
    requests = bytes.fromhex("0001 0000 0006 01 06 000a 0005" + "0001 0000 0006 01 03 00c8 0060" * 100_000)
    sending = asyncio.create_task(asyncio.get_running_loop().sock_sendall(peer, requests))
    await until(lambda: bool(live_cell.ownership.held_by(0)))
    await until(lambda: not live_cell.ownership.held_by(0))
    assert events[-1].reason == "did not read its answers for 0.1 s"
    sending.cancel()
    peer.close()
    await listener.close()


async def test_a_peer_that_does_not_read_is_not_read_from_and_then_dropped(
    live_cell: Cell, plan_of: PlanOf, monkeypatch: pytest.MonkeyPatch, events: list[PeerEvent]
) -> None:
    """The others are served throughout, and its answers take no memory."""
    monkeypatch.setattr(limits, "STALLED_AFTER", 0.3)
    monkeypatch.setattr(server, "_SWEEP", 0.05)
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(), live_cell)])
    await listener.start()
    other = await dial(listener)
    flood = socket.socket()
    flood.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    flood.connect(("127.0.0.1", listener.port))
    flood.setblocking(False)
    request = bytes.fromhex("0001 0000 0006 01 03 00c8 0060") * 500
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    dropped = False
    unsent = 0
    begin = time.monotonic()
    while not dropped and time.monotonic() - begin < 5:
        try:
            flood.send(request)
        except BlockingIOError:
            pass
        except ConnectionError:
            dropped = True
        assert await is_served(*other)
        await asyncio.sleep(0.001)
        unsent = max([unsent, *(one.wire.get_write_buffer_size() for one in listener._connections)])
    assert dropped
    assert 0 < unsent < BUFFER_SIZE // len(READ) * MAX_FRAME
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000
    assert events[-1].reason == "did not read its answers for 0.3 s"
    flood.close()
    other[1].close()
    await listener.close()


async def test_a_slow_reader_gets_everything_in_order(listener: ModbusListener) -> None:
    peer = socket.socket()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    peer.setblocking(False)
    loop = asyncio.get_running_loop()
    await loop.sock_connect(peer, ("127.0.0.1", listener.port))
    count = 5000
    requests = b"".join(struct.pack(">HHHBBHH", number, 0, 6, 1, 3, 200, 96) for number in range(count))
    sending = loop.create_task(loop.sock_sendall(peer, requests))
    received = bytearray()
    while len(received) < count * (9 + 192):
        await asyncio.sleep(0)
        received += await loop.sock_recv(peer, 65536)
    await sending
    expected = (struct.pack(">HHHBBB", number, 0, 195, 1, 3, 192) + bytes(192) for number in range(count))
    assert received == b"".join(expected)
    peer.close()


async def test_requests_before_a_half_close_are_answered(listener: ModbusListener) -> None:
    reader, writer = await dial(listener)
    writer.write(READ * 100)
    writer.write_eof()
    assert await reader.read() == ANSWER * 100
    writer.close()


async def test_a_dead_line_is_noticed_within_seconds(listener: ModbusListener) -> None:
    """The options are those of the accepted socket, whatever the system's defaults are."""
    reader, writer = await dial(listener)
    assert await is_served(reader, writer)
    (connection,) = listener._connections
    sock = connection.wire.get_extra_info("socket")
    assert sock.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
    assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 5000
    assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) == 1
    idle, interval, count = (
        sock.getsockopt(socket.IPPROTO_TCP, option)
        for option in (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
    )
    assert idle + interval * count <= 5
    writer.close()


async def test_units_have_cells_of_their_own(
    listener: ModbusListener, live_cell: Cell, new_cell: Callable[[float], Cell], plan_of: PlanOf, ask: Ask
) -> None:
    other = new_cell(time.monotonic())
    listener.serve([(plan_of(1), live_cell), (plan_of(2), other)])
    assert await ask("06 000a 0005", unit=2) == "06 00 0a 00 05"
    assert await ask("03 000a 0001", unit=1) == "03 02 00 00"
    assert await ask("03 000a 0001", unit=2) == "03 02 00 05"
    assert await ask("03 000a 0001", unit=255) == "83 0b"


async def test_two_units_of_one_number_are_refused(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, ask: Ask
) -> None:
    with pytest.raises(ValueError, match="unit 1 is served twice"):
        listener.serve([(plan_of(), live_cell), (plan_of(), live_cell)])
    assert await ask("03 000a 0001") == "03 02 00 00", "what was served before is served still"


async def test_units_come_and_go_while_connections_stay(
    listener: ModbusListener, live_cell: Cell, new_cell: Callable[[float], Cell], plan_of: PlanOf, ask: Ask
) -> None:
    assert await ask("06 000a 0005") == "06 00 0a 00 05"
    kept = listener._units[1]
    other = new_cell(time.monotonic())
    listener.serve([(kept.plan, live_cell), (plan_of(2), other)])
    assert listener._units[1] is kept
    assert other.writers.connections[0] == 1
    assert await ask("03 000a 0001", unit=2) == "03 02 00 00"
    listener.serve([(plan_of(2), other)])
    assert await ask("03 000a 0001", unit=1) == "83 0b"
    assert live_cell.writers.connections[0] == 0
    assert not live_cell.ownership.held_by(0)
    assert not live_cell.listeners


async def test_a_new_plan_for_the_same_cell_loses_no_owner(
    listener: ModbusListener, live_cell: Cell, plan_of: PlanOf, ask: Ask
) -> None:
    assert await ask("06 000a 0005") == "06 00 0a 00 05"
    listener.serve([(plan_of(), live_cell)])
    assert await ask("03 000a 0001") == "03 02 00 05"
    assert live_cell.ownership.held_by(0)
    assert live_cell.writers.connections[0] == 1
    assert len(live_cell.listeners) == 1
    (connection,) = listener._connections
    assert connection.accesses[1].requester.connection == connection.number


async def test_a_defect_costs_one_connection(
    listener: ModbusListener,
    live_cell: Cell,
    ask: Ask,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(*_arguments: object) -> None:
        raise RuntimeError("a defect")

    other = await dial(listener)
    monkeypatch.setattr(live_cell, "write", fail)
    assert await ask("06 000a 0005") == ""
    assert "could not be answered" in caplog.text
    assert await is_served(*other)
    other[1].close()


async def test_values_of_one_request_are_of_one_moment(listener: ModbusListener, live_cell: Cell) -> None:
    """All numbers of a package are equal here; no answer may mix two packages."""
    reader, writer = await dial(listener)
    outputs = live_cell.image.outputs[:48]
    stop = False

    async def robot() -> None:
        number = 0
        while not stop:
            number += 1
            for index in outputs:
                live_cell.image.values[index] = number if index < outputs[24] else float(number)
            live_cell.outputs_written(time.monotonic())
            await asyncio.sleep(0)

    task = asyncio.create_task(robot())
    seen = set()
    request = bytes.fromhex("0001 0000 0006 01 03 0064 0030 0002 0000 0006 01 03 00c8 0060")
    for _ in range(200):
        writer.write(request)
        integers = struct.unpack(">24i", (await reader.readexactly(9 + 96))[9:])
        reals = struct.unpack(">24d", (await reader.readexactly(9 + 192))[9:])
        assert len({*integers, *reals}) == 1
        seen.add(integers[0])
    stop = True
    await task
    assert len(seen) > 10
    writer.close()


async def test_listens_on_ipv6(live_cell: Cell, plan_of: PlanOf, events: list[PeerEvent]) -> None:
    listener = ModbusListener("::1", 0, observe=events.append)
    listener.serve([(plan_of(allow=("::1/128",)), live_cell)])
    try:
        await listener.start()
    except ListenError:
        pytest.skip("this machine has no IPv6 loopback")
    assert listener.name == "[::1]:0"
    reader, writer = await asyncio.open_connection("::1", listener.port)
    assert await is_served(reader, writer)
    assert events[0].peer == f"[::1]:{writer.get_extra_info('sockname')[1]}"
    writer.close()
    await listener.close()


def test_the_start_does_not_wait_for_aiohttp() -> None:
    """Nothing needs it before the gateway serves, and it would be most of the time until then. Nor pymodbus."""
    script = (
        "import sys, gatewayd.service.daemon, gatewayd.cli.run, gatewayd.service.operator; "
        "assert not {'aiohttp', 'pymodbus'} & set(sys.modules); "
        "import aiohttp.web"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
