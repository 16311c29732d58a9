"""Transfers with nodes that nobody manages: several at a time, silence, and a bus that is away."""

from __future__ import annotations

import asyncio
from uuid import uuid4

import pytest

from gatewayd.canopen.bus import BusError
from gatewayd.canopen.manager.direct import BusAway, DirectBus
from tests.links.devices.canopen.cells import an_encoder


async def test_transfers() -> None:
    channel = str(uuid4())
    async with an_encoder(channel) as encoder, DirectBus("virtual", channel, 500_000, 0.1) as bus:
        read, other, silent = await asyncio.gather(
            bus.transfer(5, 0x6004, 0), bus.transfer(5, 0x2003, 0), bus.transfer(6, 0x1000, 0)
        )
        assert (read.data, other.code, silent.silent) == (b"\xdc\5\0\0", 0x06020000, True)
        assert (await bus.transfer(5, 0x6200, 1, b"\7")).good
        assert encoder.get(0x6200, 1) == 7


async def test_bus_that_is_away() -> None:
    with pytest.raises((BusAway, BusError)):
        async with DirectBus("socketcan", "no-such-can", 500_000, 0.1):
            pass
