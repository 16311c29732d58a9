"""The island of the demonstration: its terminals, its frames, and that the mapping knows them."""

from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest

from gatewayd.demo.island import NEXT_PART, Island, Terminals
from gatewayd.demo.scene import HOST, Scene, free_port

CLOSE, OPEN = bytes.fromhex("050000ff00"), bytes.fromhex("0500000000")
COIL, SENSOR = bytes.fromhex("0100000001"), bytes.fromhex("0200000001")


def test_part_goes_with_the_clamp_and_the_next_one_comes() -> None:
    terminals = Terminals()
    assert terminals.answer(SENSOR, 0.0) == bytes([2, 1, 1])
    assert terminals.answer(CLOSE, 1.0) == CLOSE
    assert terminals.answer(COIL, 1.0) == bytes([1, 1, 1])
    assert terminals.answer(OPEN, 2.0) == OPEN
    assert terminals.answer(SENSOR, 2.0) == bytes([2, 1, 0])
    assert terminals.answer(SENSOR, 2.0 + NEXT_PART) == bytes([2, 1, 1])
    assert (terminals.closed, terminals.requests, terminals.refused) == (1, 6, 0)


def test_what_is_written_again_moves_nothing() -> None:
    terminals = Terminals()
    terminals.answer(CLOSE, 1.0)
    terminals.answer(CLOSE, 2.0)
    assert terminals.closed == 1
    terminals.answer(OPEN, 3.0)
    terminals.answer(OPEN, 3.0 + NEXT_PART)
    assert terminals.part_there(3.0 + NEXT_PART)


@pytest.mark.parametrize(
    "pdu, code",
    [("0300000001", 1), ("01", 1), ("", 1), ("0100010001", 2), ("0200000002", 2), ("050007ff00", 2)],
)
def test_what_it_does_not_have_is_an_exception(pdu: str, code: int) -> None:
    terminals = Terminals()
    request = bytes.fromhex(pdu)
    assert terminals.answer(request, 0.0) == bytes([(request or b"\0")[0] | 0x80, code])
    assert terminals.refused == 1


def test_rate_is_that_of_the_last_second() -> None:
    terminals = Terminals()
    for number in range(30):
        terminals.answer(SENSOR, number / 10)
    assert terminals.rate(2.9) == 11
    assert terminals.rate(60.0) == 0


async def test_no_frame_of_modbus_ends_the_connection() -> None:
    port = free_port(HOST)
    serving = asyncio.create_task(Island(HOST, port).run())
    reader, writer = await _connected(port)
    writer.write(bytes.fromhex("000700000006010200000001"))
    assert (await reader.readexactly(10)).hex() == "00070000000401020101"
    writer.write(b"GET / HTTP/1.1\r\n")
    assert await reader.read() == b""
    writer.close()
    serving.cancel()


async def test_gateway_has_its_sensor_and_its_clamp(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    terminals = scene.island.terminals
    names = [variable.name for variable in scene.cell.definition.variables]
    sensor = names.index("part_there")
    seen = set()

    def both() -> bool:
        seen.add(scene.cell.image.values[sensor])
        return terminals.closed >= 2 and seen == {True, False}

    await until(both)
    assert terminals.refused == 0
    assert scene.cell.definition.writer_name(scene.cell.ownership.owners[_lock(scene)] or 0) == "island"


async def _connected(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A connection, as soon as the island listens."""
    async with asyncio.timeout(10):
        while True:
            with suppress(ConnectionRefusedError):
                return await asyncio.open_connection(HOST, port)
            await asyncio.sleep(0)


def _lock(scene: Scene) -> int:
    return next(index for index, lock in enumerate(scene.cell.definition.locks) if lock.name == "part_there")
