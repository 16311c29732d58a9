"""Clients that others wrote: pyModbusTCP, pymodbus, libmodbus itself and mbpoll, which stands on it."""

from __future__ import annotations

import asyncio
import ctypes
import ctypes.util
import shutil
from collections.abc import Callable
from dataclasses import replace
from ipaddress import ip_network

import pytest
from pymodbus.client import AsyncModbusTcpClient
from pyModbusTCP.client import ModbusClient

from gatewayd import __version__
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


async def test_mbpoll_reads_a_block_from_0_on_over_gaps(
    everybody_writes: ModbusListener, live_cell: Cell, plan_of: Callable[..., ModbusPlan]
) -> None:
    """In all four areas, with the first and the last block of 125 and 2000."""
    everybody_writes.serve([(plan_of(fill_gaps=True), live_cell)])
    for kind, last, count in ("4", 59_875, 125), ("3", 59_875, 125), ("1", 59_875, 125), ("0", 59_875, 125):
        for first in (0, last):
            output = await mbpoll(
                everybody_writes, "-t", kind, "-r", f"{first}", "-c", f"{count}", "127.0.0.1"
            )
            assert f"[{first + count - 1}]: \t0" in output
    assert "Illegal data address" in await mbpoll(
        everybody_writes, "-t", "4", "-r", "59876", "-c", "125", "127.0.0.1"
    )


async def test_pymodbus_uses_query_data_as_a_keep_alive(everybody_writes: ModbusListener) -> None:
    async with AsyncModbusTcpClient("127.0.0.1", port=everybody_writes.port) as client:
        answer = await client.diag_query_data(b"\x12\x34\x56\x78")
        assert not answer.isError()
        assert answer.encode() == b"\0\0\x12\x34\x56\x78"
        identified = await client.report_device_id()
        assert not identified.isError()
        assert b"gatewayd " in identified.identifier


LIBMODBUS = ctypes.util.find_library("modbus")


@pytest.mark.skipif(LIBMODBUS is None, reason="libmodbus (Debian package) is not installed")
async def test_libmodbus_reads_the_server_id_as_it_writes_its_own(everybody_writes: ModbusListener) -> None:
    library = ctypes.CDLL(LIBMODBUS)
    library.modbus_new_tcp.restype = ctypes.c_void_p
    context = ctypes.c_void_p(library.modbus_new_tcp(b"127.0.0.1", everybody_writes.port))
    content = ctypes.create_string_buffer(260)

    def converse() -> int:
        assert library.modbus_set_slave(context, 1) == 0
        assert library.modbus_connect(context) == 0
        return int(library.modbus_report_slave_id(context, len(content), content))

    count = await asyncio.to_thread(converse)
    library.modbus_close(context)
    library.modbus_free(context)
    assert content.raw[:count] == bytes((1, 0xFF)) + f"gatewayd {__version__} press-3".encode()
