"""Nonsense from a peer costs that peer its connection at most.

GATEWAYD_FUZZ_CASES raises the number of streams; every one is made from its number, so a failure can be repeated.
"""

from __future__ import annotations

import asyncio
import os
import random
import resource
import struct
from collections.abc import Awaitable, Callable

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.session import ModbusSession, UnitAccess
from gatewayd.modbus.frames import MAX_FRAME

CASES = int(os.environ.get("GATEWAYD_FUZZ_CASES", "5000"))
NOW = 1000.0
FUNCTIONS = (1, 2, 3, 4, 5, 6, 15, 16, 22, 23, 43)
ADDRESSES = (0, 1, 10, 11, 13, 14, 20, 100, 200, 300, 301, 500, 59999, 60000, 60040, 60041, 64287, 65535)

Ask = Callable[..., Awaitable[str]]


def made_pdu(chance: random.Random) -> bytes:
    """Mostly well-formed, so that it gets further than the length check."""
    function = chance.choice(FUNCTIONS) if chance.random() < 0.9 else chance.randrange(256)
    address = chance.choice(ADDRESSES) if chance.random() < 0.8 else chance.randrange(65536)
    count = chance.choice((0, 1, 2, 4, 8, 121, 123, 125, 126, 1968, 2000, 65535))
    pdu = struct.pack(">BHH", function, address, count)
    if function == 15:
        size = (count + 7) // 8 & 0xFF
        pdu += bytes((size,)) + chance.randbytes(size)
    elif function == 16:
        pdu += bytes((2 * count & 0xFF,)) + chance.randbytes(2 * count & 0xFF)
    elif function == 22:
        pdu += chance.randbytes(2)
    elif function == 23:
        written = chance.choice((0, 1, 2, 4, 121, 122))
        pdu += struct.pack(">HHB", chance.choice(ADDRESSES), written, 2 * written) + chance.randbytes(
            2 * written
        )
    elif function == 43:
        pdu = bytes((43, 14, chance.randrange(6), chance.randrange(256)))
    pdu = pdu[:253]
    if chance.random() < 0.1:
        pdu = pdu[: chance.randrange(1, len(pdu) + 1)]
    return pdu


def made_stream(chance: random.Random) -> bytes:
    """A few frames, now and then with a wrong byte, or no frames at all."""
    if chance.random() < 0.05:
        return chance.randbytes(chance.randrange(1, 600))
    frames = bytearray()
    for _ in range(chance.randrange(1, 6)):
        pdu = made_pdu(chance)
        unit = chance.choice((1, 1, 1, 0, 255, 7))
        frames += struct.pack(">HHHB", chance.randrange(65536), 0, len(pdu) + 1, unit) + pdu
    if chance.random() < 0.2:
        frames[chance.randrange(len(frames))] = chance.randrange(256)
    return bytes(frames)


def answered(session: ModbusSession, data: bytes, chance: random.Random) -> bytes:
    """Hand the stream over in pieces, as long as the session takes it."""
    answers = bytearray()
    position = 0
    while position < len(data) and not session.broken:
        piece = data[position : position + min(chance.randrange(1, 300), len(session.buffer.space[0]))]
        session.buffer.space[0][: len(piece)] = piece
        answers += session.received(len(piece), NOW)
        position += len(piece)
    return bytes(answers)


def test_any_stream_gets_whole_answers(cell: Cell, unit: Unit) -> None:
    """One per frame that is whole, with its transaction and unit; and the buffer stays what it is."""
    for case in range(CASES):
        chance = random.Random(case)
        session = ModbusSession()
        session.serve({1: UnitAccess(unit, Requester(chance.choice((0, 1, None))))})
        data = made_stream(chance)
        answers = answered(session, data, chance)
        asked = position = 0
        while position < len(answers):
            transaction, protocol, length, number, function = struct.unpack_from(">HHHBB", answers, position)
            size = int.from_bytes(data[asked + 4 : asked + 6], "big")
            expected = (int.from_bytes(data[asked : asked + 2], "big"), 0, data[asked + 6])
            assert (transaction, protocol, number) == expected, f"case {case}"
            assert function | 0x80 == data[asked + 7] | 0x80, f"case {case}"
            assert 6 + length <= MAX_FRAME, f"case {case}"
            asked += 6 + size
            position += 6 + length
        assert position == len(answers), f"case {case}"
        assert len(session.buffer.data) == len(ModbusSession().buffer.data)
        if not session.broken:
            assert len(data) - asked == session.buffer.end < MAX_FRAME, f"case {case}"
    assert len(cell.events) <= 4096


@pytest.mark.parametrize("round_number", range(2))
async def test_the_server_lives_on(
    listener: ModbusListener, ask: Ask, live_cell: Cell, round_number: int
) -> None:
    """Real connections, many at once, each ended in a way of its own; the others are served all the time."""
    chance = random.Random(round_number)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    async def nuisance(number: int) -> None:
        own = random.Random(number)
        reader, writer = await asyncio.open_connection(
            "127.0.0.1", listener.port, local_addr=(f"127.0.0.{own.choice((1, 3))}", 0)
        )
        try:
            for _ in range(own.randrange(1, 10)):
                writer.write(made_stream(own))
                if own.random() < 0.5:
                    await asyncio.wait_for(reader.read(4096), 0.02)
            if own.random() < 0.5:
                writer.close()
                return
        except (OSError, TimeoutError):
            pass
        writer.transport.abort()

    for _ in range(max(1, CASES // 500)):
        nuisances = [asyncio.create_task(nuisance(chance.randrange(1 << 30))) for _ in range(16)]
        while not all(task.done() for task in nuisances):
            assert await ask("03 0064 0001", "127.0.0.2") == "03 02 00 00"
            await asyncio.sleep(0.002)
        await asyncio.gather(*nuisances)
    async with asyncio.timeout(5):
        while listener.connections > 1:  # noqa: ASYNC110 - the last ones are being closed
            await asyncio.sleep(0.01)
    assert live_cell.writers.connections == [1, 0]
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 30_000
