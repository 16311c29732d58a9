"""Clients that others wrote: pyModbusTCP and mbpoll (libmodbus)."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from dataclasses import replace
from ipaddress import ip_network

import pytest
from pyModbusTCP.client import ModbusClient

from gatewayd.core.cell import Cell
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.plan import ModbusPlan

IndexOf = Callable[[str], int]

needs_mbpoll = pytest.mark.skipif(
    shutil.which("mbpoll") is None, reason="mbpoll (Debian package) is not installed"
)


@pytest.fixture
def everybody_writes(
    listener: ModbusListener, live_cell: Cell, plan_of: Callable[..., ModbusPlan]
) -> ModbusListener:
    """These clients cannot choose their own address: 127.0.0.1 is the PLC here."""
    listener.serve([(replace(plan_of(), writers=((ip_network("127.0.0.1/32"), 0),)), live_cell)])
    return listener


async def test_pymodbustcp_reads_and_writes_everything(
    everybody_writes: ModbusListener, live_cell: Cell, index_of: IndexOf
) -> None:
    client = ModbusClient("127.0.0.1", everybody_writes.port, unit_id=1, timeout=5)
    live_cell.image.values[index_of("int_0")] = -2
    live_cell.image.values[index_of("bit_17")] = True
    live_cell.outputs_written(0.0)

    def converse() -> None:
        assert client.read_holding_registers(100, 2) == [0xFFFF, 0xFFFE]
        assert client.read_input_registers(0, 2) == [0xFFFF, 0xFFFE]
        assert client.read_discrete_inputs(3, 32) == [bit == 17 for bit in range(32)]
        assert client.write_multiple_registers(11, [1, 2])
        assert client.write_single_register(10, 77)
        assert client.write_single_coil(3, bit_value=True)
        assert client.write_multiple_coils(4, [True, False, True])
        assert client.read_coils(0, 10) == [False] * 3 + [True, True, False, True] + [False] * 3
        assert client.read_holding_registers(10, 3) == [77, 1, 2]
        assert client.write_read_multiple_registers(10, [5], 10, 1) == [5]
        assert client.read_holding_registers(1, 1) is None
        assert client.last_except == 2
        identification = client.read_device_identification()
        assert identification is not None
        assert identification.vendor_name == b"gatewayd"
        assert live_cell.image.values[index_of("count")] == 0x10002
        client.close()

    await asyncio.to_thread(converse)


async def mbpoll(listener: ModbusListener, *arguments: str) -> str:
    process = await asyncio.create_subprocess_exec(
        "mbpoll", "-m", "tcp", "-p", str(listener.port), "-a", "1", "-0", "-1", *arguments,
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
    )  # fmt: skip
    output, _ = await process.communicate()
    return output.decode()


@needs_mbpoll
async def test_mbpoll_reads_numbers(
    everybody_writes: ModbusListener, live_cell: Cell, index_of: IndexOf
) -> None:
    live_cell.image.values[index_of("int_3")] = -123456
    live_cell.image.values[index_of("swapped")] = 1.5
    live_cell.outputs_written(0.0)
    integers = await mbpoll(everybody_writes, "-t", "4:int", "-B", "-r", "100", "-c", "4", "127.0.0.1")
    assert "[106]: \t-123456" in integers
    reals = await mbpoll(everybody_writes, "-t", "4:float", "-r", "301", "-c", "1", "127.0.0.1")
    assert "[301]: \t1.5" in reals
    inputs = await mbpoll(everybody_writes, "-t", "3", "-r", "7", "-c", "1", "127.0.0.1")
    assert "[7]: \t7616" in inputs


@needs_mbpoll
async def test_mbpoll_writes_and_is_refused(everybody_writes: ModbusListener) -> None:
    assert "Written 1 references" in await mbpoll(
        everybody_writes, "-t", "4", "-r", "10", "127.0.0.1", "4711"
    )
    assert "Written 3 references" in await mbpoll(
        everybody_writes, "-t", "0", "-r", "2", "127.0.0.1", "1", "0", "1"
    )
    assert "Illegal data address" in await mbpoll(
        everybody_writes, "-t", "4", "-r", "100", "127.0.0.1", "1", "2"
    )
    assert "Illegal data value" in await mbpoll(everybody_writes, "-t", "4", "-r", "11", "127.0.0.1", "1")
