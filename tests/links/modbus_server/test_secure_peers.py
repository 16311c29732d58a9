"""Modbus/TCP Security with clients that others wrote: the Go package simonvetter/modbus, and `openssl s_client`."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent, PeerEventKind
from gatewayd.links.modbus_server.plan import ModbusPlan
from tests.links.modbus_server.secured import Certificates, frame, listening, secured
from tests.peers.authority import OPENSSL, Issued
from tests.peers.programs import go_client

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="no program openssl")


@pytest.fixture
def plan(
    certificates: Certificates, plan_of: Callable[..., ModbusPlan], index_of: Callable[[str], int]
) -> ModbusPlan:
    return secured(plan_of(), certificates.files(), index_of)


@pytest.fixture
async def listener(plan: ModbusPlan, live_cell: Cell) -> AsyncIterator[ModbusListener]:
    async with listening(plan, live_cell) as listener:
        yield listener


@pytest.fixture(scope="session")
def go_program(tmp_path_factory: pytest.TempPathFactory) -> str:
    return go_client(tmp_path_factory.mktemp("go"))


async def said(*command: str, send: bytes = b"", until: int = 0) -> tuple[bytes, bytes]:
    """What a program says when it is sent this: `until` so many bytes came, or it ends."""
    process = await asyncio.create_subprocess_exec(
        *command,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stderr is not None
    async with asyncio.timeout(20):
        process.stdin.write(send)
        if until:
            out = await process.stdout.readexactly(until)
            process.kill()
            return out, await process.stderr.read()
        process.stdin.close()
        return await process.stdout.read(), await process.stderr.read()


@pytest.mark.parametrize(
    "who,expected",
    [
        ("operator", ["read: 0 <nil>", "write: <nil>", "read: 7 <nil>"]),
        ("viewer", ["read: 0 <nil>", "write: illegal function", "read: 0 <nil>"]),
        ("guest", ["read: 0 illegal function", "write: illegal function", "read: 0 illegal function"]),
        ("none", ["read: 0 illegal function", "write: illegal function", "read: 0 illegal function"]),
    ],
)
async def test_a_go_client_with_the_right_role_another_and_none(
    listener: ModbusListener, certificates: Certificates, go_program: str, who: str, expected: list[str]
) -> None:
    issued: Issued = getattr(certificates, who)
    authority = str(certificates.authority.certificate)
    out, _ = await said(
        go_program, f"127.0.0.1:{listener.port}", str(issued.certificate), str(issued.key), authority
    )
    assert out.decode().splitlines() == expected


def s_client(listener: ModbusListener, certificates: Certificates, *options: str) -> list[str]:
    return [
        str(OPENSSL),
        *("s_client", "-quiet", "-no_ign_eof", "-connect", f"127.0.0.1:{listener.port}"),
        *("-cert", str(certificates.operator.certificate), "-key", str(certificates.operator.key)),
        *("-CAfile", str(certificates.authority.certificate), *options),
    ]


@pytest.mark.parametrize("version", ["-tls1_2", "-tls1_3"])
async def test_r57_r58_a_fragment_length_of_512_is_agreed_and_kept(
    listener: ModbusListener, certificates: Certificates, version: str
) -> None:
    """Answers of more than 512 bytes in all come in several records, each no longer than that."""
    count = 60
    reads = b"".join(frame(bytes.fromhex("03 00c8 0060"), number) for number in range(count))
    trace: Path = certificates.authority.folder / f"trace{version}.txt"
    options = (version, "-maxfraglen", "512", "-msg", "-msgfile", str(trace))
    out, _ = await said(*s_client(listener, certificates, *options), send=reads, until=count * (9 + 192))
    assert out[:9] == bytes.fromhex("0000 0000 00c3 01 03 c0")
    assert out[-201:-199] == bytes((0, count - 1))
    lengths = [int.from_bytes(header[3:]) for header in _headers(trace) if header[0] == _DATA]
    assert len(lengths) > count * 201 // 600
    assert max(lengths) <= 512 + _EXPANSION


_DATA = 0x17
_EXPANSION = 32
"""Bytes of a record beside its content, at most: nonce, tag, and with TLS 1.3 the type."""


def _headers(trace: Path) -> list[bytes]:
    """Headers of the records that came in, as `-msg` shows them: the line below has the bytes."""
    lines = trace.read_text().splitlines()
    return [
        bytes.fromhex(below)
        for line, below in pairwise(lines)
        if line.startswith("<<<") and "RecordHeader" in line
    ]


async def test_r34_s_client_with_an_old_version(listener: ModbusListener, certificates: Certificates) -> None:
    options = ("-tls1_1", "-cipher", "DEFAULT:@SECLEVEL=0")
    _out, error = await said(*s_client(listener, certificates, *options))
    assert b"alert protocol version" in error
    assert listener.refusals["unsecured"] == 1


async def test_no_renegotiation(listener: ModbusListener, certificates: Certificates) -> None:
    """`R` on a line of its own asks s_client for one."""
    command = [word for word in s_client(listener, certificates, "-tls1_2") if word != "-quiet"]
    out, error = await said(*command, send=b"R\n")
    assert b"RENEGOTIATING" in out + error
    assert b"no renegotiation" in error


async def test_a_client_that_only_changes_keys_is_ended(
    plan: ModbusPlan, live_cell: Cell, certificates: Certificates, events: list[PeerEvent]
) -> None:
    """Each costs the loop as much as ten requests, and is none. `K` has s_client send one."""
    async with listening(plan, live_cell, events) as listener, asyncio.timeout(20):
        process = await asyncio.create_subprocess_exec(
            *(word for word in s_client(listener, certificates, "-tls1_3") if word != "-quiet"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.DEVNULL,
        )
        assert process.stdin is not None
        with suppress(ConnectionError):
            while process.returncode is None:
                process.stdin.write(b"K\n" * 4096)
                await process.stdin.drain()
        await process.wait()
        while not events or events[-1].kind is not PeerEventKind.DISCONNECTED:  # noqa: ASYNC110 - no event of its own
            await asyncio.sleep(0.005)
    assert events[-1].reason == "TLS: it sends records without requests"
