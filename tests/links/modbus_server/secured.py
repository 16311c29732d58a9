"""A secured listener on a free port, certificates for its clients, and clients that are Python's `ssl` alone."""

from __future__ import annotations

import asyncio
import ssl
import struct
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from ipaddress import ip_network
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent
from gatewayd.links.modbus_server.plan import ModbusPlan, RoleRights, RoleWriter, SecuredPlan, TrustFiles
from gatewayd.links.modbus_server.renewal import make_ready
from tests.links.modbus_server.conftest import HMI, PLC
from tests.peers.authority import Authority, Issued

READ = bytes.fromhex("03 000a 0001")
"""Part, a number that `setter` may read."""
WRITE = bytes.fromhex("06 000a 0007")
ALLOWED = WRITE
ILLEGAL_READ, ILLEGAL_WRITE = bytes.fromhex("83 01"), bytes.fromhex("86 01")


@dataclass(frozen=True)
class Certificates:
    """What the tests need, made once: generating keys takes time."""

    authority: Authority
    other: Authority
    gateway: Issued
    operator: Issued
    setter: Issued
    viewer: Issued
    guest: Issued
    """Its role stands in no mapping."""
    none: Issued
    """Without a role."""
    foreign: Issued
    """Of another authority, with the right role."""

    def files(self, *, revoked: bool = True) -> TrustFiles:
        """As a mapping names them."""
        return TrustFiles(
            str(self.gateway.certificate),
            str(self.gateway.key),
            str(self.authority.certificate),
            str(self.authority.revoked) if revoked else None,
        )


def make_certificates(folder: Path) -> Certificates:
    """Takes about a second."""
    authority, other = Authority(folder / "ours"), Authority(folder / "other", "Other")
    roles = {role: authority.role(role, key="ec") for role in ("operator", "setter", "viewer", "guest")}
    return Certificates(
        authority,
        other,
        authority.issue("gateway", "subjectAltName = IP:127.0.0.1"),
        none=authority.issue("none", key="ec"),
        foreign=other.role("operator", key="ec"),
        **roles,
    )


def secured(plan: ModbusPlan, files: TrustFiles, index_of: Callable[[str], int]) -> ModbusPlan:
    """The plan with a listener that has roles: one may all, one something, one only read, and one is nowhere named."""
    part, count = index_of("part"), index_of("count")
    roles = (
        RoleRights("operator", None, None),
        RoleRights("setter", (part, count), (part, index_of("start"))),
        RoleRights("viewer", None),
    )
    writers = (RoleWriter("operator", None, PLC), RoleWriter("setter", ip_network("127.0.0.3/32"), HMI))
    return replace(
        plan,
        tls=SecuredPlan("127.0.0.1", 0, files, roles, writers),
        writers=((ip_network("127.0.0.2/32"), PLC),),
    )


def client_context(certificates: Certificates, issued: Issued | None) -> ssl.SSLContext:
    """A client that knows the authority, and shows this certificate."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.load_verify_locations(certificates.authority.certificate)
    if issued is not None:
        context.load_cert_chain(issued.certificate, issued.key)
    return context


class Client:
    """One connection with TLS."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer
        self._transactions: Iterator[int] = iter(range(1, 65536))

    async def ask(self, pdu: bytes, unit: int = 1) -> bytes:
        """The answer's PDU; empty if the server closed."""
        transaction = next(self._transactions)
        self.writer.write(frame(pdu, transaction, unit))
        try:
            head = await self.reader.readexactly(7)
            answered, protocol, length, echoed = struct.unpack(">HHHB", head)
            assert (answered, protocol, echoed) == (transaction, 0, unit)
            return await self.reader.readexactly(length - 1)
        except (asyncio.IncompleteReadError, ConnectionError, ssl.SSLError):
            return b""

    @property
    def tls(self) -> ssl.SSLObject:
        """The engine of this side."""
        found: ssl.SSLObject = self.writer.get_extra_info("ssl_object")
        return found


def frame(pdu: bytes, transaction: int = 1, unit: int = 1) -> bytes:
    """A request with its header, as without TLS (R-05)."""
    return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu


@asynccontextmanager
async def dialled(
    listener: ModbusListener, context: ssl.SSLContext, source: str = "127.0.0.1"
) -> AsyncIterator[Client]:
    """A client that has finished its handshake."""
    reader, writer = await asyncio.open_connection(
        "127.0.0.1", listener.port, ssl=context, local_addr=(source, 0), ssl_handshake_timeout=10
    )
    try:
        yield Client(reader, writer)
    finally:
        writer.transport.abort()


@asynccontextmanager
async def listening(
    plan: ModbusPlan, cell: Cell, events: list[PeerEvent] | None = None
) -> AsyncIterator[ModbusListener]:
    """The secured listener of the plan, on a free port."""
    assert plan.tls is not None
    observe = (lambda _event: None) if events is None else events.append
    listener = ModbusListener("127.0.0.1", 0, files=plan.tls.files, observe=observe)
    listener.serve([(plan, cell)])
    await make_ready(listener)
    await listener.start()
    try:
        yield listener
    finally:
        await listener.close()
