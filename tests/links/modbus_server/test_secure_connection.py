"""Modbus/TCP Security on real sockets: each requirement that can be tested, by its number (v3.6, 2021-07-30)."""

from __future__ import annotations

import asyncio
import socket
import ssl
import time
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.refusal import Reason
from gatewayd.links.modbus_server import handshakes, trust, waiting
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent, PeerEventKind
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.renewal import renew_changed
from gatewayd.loop import clock
from tests.links.modbus_server.secured import (
    ILLEGAL_READ,
    ILLEGAL_WRITE,
    READ,
    WRITE,
    Certificates,
    client_context,
    dialled,
    frame,
    listening,
    secured,
)
from tests.peers.authority import OPENSSL, Authority

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="no program openssl")


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110 - conditions of others have no event
            await asyncio.sleep(0.005)


@pytest.fixture
def plan(
    certificates: Certificates, plan_of: Callable[..., ModbusPlan], index_of: Callable[[str], int]
) -> ModbusPlan:
    return secured(plan_of(), certificates.files(), index_of)


@pytest.fixture
async def listener(
    plan: ModbusPlan, live_cell: Cell, events: list[PeerEvent]
) -> AsyncIterator[ModbusListener]:
    async with listening(plan, live_cell, events) as listener:
        yield listener


async def refusal(listener: ModbusListener, context: ssl.SSLContext) -> str:
    """What the client's TLS says when it is refused. TLS 1.3 tells a client after its own handshake."""
    try:
        async with dialled(listener, context) as client:
            client.writer.write(frame(READ))
            await client.reader.readexactly(1)
    except ssl.SSLError as error:
        return str(error.reason)
    except (ConnectionError, asyncio.IncompleteReadError) as error:
        return type(error).__name__
    return "served"


# -- who is let in ------------------------------------------------------------------------------------------------


async def test_a_client_with_a_role_reads_and_writes(
    listener: ModbusListener, certificates: Certificates, live_cell: Cell, index_of: Callable[[str], int]
) -> None:
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        assert await client.ask(WRITE) == WRITE
        assert await client.ask(READ) == bytes.fromhex("03 02 0007")
        assert live_cell.image.values[index_of("part")] == 7


async def test_r05_the_header_is_that_of_modbus_tcp(
    listener: ModbusListener, certificates: Certificates
) -> None:
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        client.writer.write(bytes.fromhex("1501 0000 0006 01 03 000a 0001"))
        assert await client.reader.readexactly(11) == bytes.fromhex("1501 0000 0005 01 03 02 0000")


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
async def test_r01_r32_tls_1_2_or_later_is_spoken(
    listener: ModbusListener, certificates: Certificates, version: ssl.TLSVersion
) -> None:
    context = client_context(certificates, certificates.operator)
    context.minimum_version = context.maximum_version = version
    async with dialled(listener, context) as client:
        assert client.tls.version() == version.name.replace("_", ".")
        assert await client.ask(READ)


@pytest.mark.filterwarnings("ignore:ssl.TLSVersion")
async def test_r34_nothing_older_is_spoken(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent]
) -> None:
    context = client_context(certificates, certificates.operator)
    context.set_ciphers("ALL:@SECLEVEL=0")
    context.minimum_version = context.maximum_version = ssl.TLSVersion.TLSv1_1
    assert await refusal(listener, context) == "TLSV1_ALERT_PROTOCOL_VERSION"
    assert events[-1].reason == "the client speaks no TLS 1.2 or later"


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
async def test_r02_r06_r44_without_a_certificate_there_is_a_fatal_alert(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent], version: ssl.TLSVersion
) -> None:
    context = client_context(certificates, None)
    context.minimum_version = context.maximum_version = version
    found = await refusal(listener, context)
    assert found in ("SSLV3_ALERT_HANDSHAKE_FAILURE", "TLSV13_ALERT_CERTIFICATE_REQUIRED")
    assert (events[-1].kind, events[-1].reason) == (
        PeerEventKind.UNVERIFIED,
        "the client shows no certificate",
    )
    assert listener.refusals["unverified"] == 1


async def test_r07_r10_a_certificate_of_another_authority_is_refused(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent]
) -> None:
    assert (
        await refusal(listener, client_context(certificates, certificates.foreign))
        == "TLSV1_ALERT_UNKNOWN_CA"
    )
    assert events[-1].kind is PeerEventKind.UNVERIFIED
    assert events[-1].reason.endswith(": its authority is not in `clients`")


async def test_r14_the_mandatory_cipher_suite_is_served(
    listener: ModbusListener, certificates: Certificates
) -> None:
    context = client_context(certificates, certificates.operator)
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    context.set_ciphers("ECDHE-RSA-AES128-GCM-SHA256")
    async with dialled(listener, context) as client:
        found = client.tls.cipher()
        assert found is not None
        assert found[0] == "ECDHE-RSA-AES128-GCM-SHA256"
        assert await client.ask(READ)


async def test_r67_no_cipher_suite_is_without_encryption(
    listener: ModbusListener, certificates: Certificates
) -> None:
    names = {cipher["name"] for cipher in listener.trust.context.get_ciphers()}
    assert names
    assert not any("NULL" in name or "ADH" in name or "CBC" in name for name in names)
    context = client_context(certificates, certificates.operator)
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    context.set_ciphers("eNULL:@SECLEVEL=0")
    assert await refusal(listener, context) in ("SSLV3_ALERT_HANDSHAKE_FAILURE", "NO_CIPHERS_AVAILABLE")


# -- roles ----------------------------------------------------------------------------------------------------------


async def test_r21_the_role_of_the_certificate_names_the_writer(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent]
) -> None:
    async with dialled(listener, client_context(certificates, certificates.operator)):
        await until(lambda: bool(events))
        shown = events[-1].credentials
        assert shown is not None
        assert (shown.role, shown.name, events[-1].writers) == ("operator", "CN=operator", ("plc",))


@pytest.mark.parametrize(
    "extensions,reason",
    [
        (("1.3.6.1.4.1.50316.802.1 = ASN1:PRINTABLESTRING:operator",), "not one UTF8String"),
        (
            ("1.3.6.1.4.1.50316.802.1 = ASN1:SEQUENCE:two", "[two]", "a = UTF8:operator", "b = UTF8:viewer"),
            "not one",
        ),
    ],
    ids=["other type", "two in one"],
)
async def test_r22_r65_there_is_exactly_one_role_or_no_connection(
    listener: ModbusListener,
    certificates: Certificates,
    events: list[PeerEvent],
    extensions: tuple[str, ...],
    reason: str,
) -> None:
    wrong = certificates.authority.issue(f"wrong{len(extensions)}", *extensions, key="ec")
    assert await refusal(listener, client_context(certificates, wrong)) != "served"
    assert events[-1].kind is PeerEventKind.UNVERIFIED
    assert reason in events[-1].reason


@pytest.mark.parametrize("who", ["none", "guest"])
async def test_r23_r31_no_role_and_one_that_no_mapping_names_are_judged_and_refused_with_01(
    listener: ModbusListener, certificates: Certificates, live_cell: Cell, who: str
) -> None:
    async with dialled(listener, client_context(certificates, getattr(certificates, who))) as client:
        assert await client.ask(READ) == ILLEGAL_READ
        assert await client.ask(WRITE) == ILLEGAL_WRITE
        assert await client.ask(bytes.fromhex("03 ffff 0001")) == ILLEGAL_READ, "it learns nothing of the map"
        assert await client.ask(bytes.fromhex("11")) == bytes.fromhex("91 01")
    last = live_cell.last_unserved
    assert last is not None
    assert last.peer == f"127.0.0.1 ({'no role' if who == 'none' else 'role guest'})"


async def test_r26_r27_r28_rights_are_those_of_the_mapping(
    listener: ModbusListener, plan: ModbusPlan, certificates: Certificates, live_cell: Cell
) -> None:
    """The same certificate before and after a reload that gives its role a right."""
    assert plan.tls is not None
    async with dialled(listener, client_context(certificates, certificates.none)) as client:
        assert await client.ask(READ) == ILLEGAL_READ
        rights = replace(plan.tls.roles[2], role=None)
        listener.serve([(replace(plan, tls=replace(plan.tls, roles=(rights,))), live_cell)])
        assert await client.ask(READ) == bytes.fromhex("03 02 0000")
        assert await client.ask(WRITE) == ILLEGAL_WRITE


async def test_r31_a_role_reads_and_writes_what_it_may_and_nothing_else(
    listener: ModbusListener, certificates: Certificates, live_cell: Cell, index_of: Callable[[str], int]
) -> None:
    async with dialled(
        listener, client_context(certificates, certificates.setter), source="127.0.0.3"
    ) as client:
        assert await client.ask(WRITE) == WRITE
        assert await client.ask(WRITE) == WRITE, "the second time it is a usual one"
        assert await client.ask(READ) == bytes.fromhex("03 02 0007")
        assert await client.ask(bytes.fromhex("03 000a 0004")) == ILLEGAL_READ, "force lies behind"
        assert await client.ask(bytes.fromhex("10 000b 0002 04 00000001")) == bytes.fromhex("90 01"), "count"
        refused = live_cell.last_refusal
        assert refused is not None
        assert refused.refusal.variable == index_of("count")
        assert await client.ask(bytes.fromhex("06 0000 0001")) == bytes.fromhex("86 02"), (
            "start is plc's: ownership"
        )
        assert await client.ask(bytes.fromhex("06 0000 8000")) == ILLEGAL_WRITE, "mode is no right of it"
        assert await client.ask(bytes.fromhex("06 03e7 0001")) == bytes.fromhex("86 02"), "nothing is there"
        assert await client.ask(bytes.fromhex("06 000b 0001")) == ILLEGAL_WRITE, (
            "half of count: the role comes first"
        )
        assert await client.ask(bytes.fromhex("16 000b ffff 0000")) == bytes.fromhex("96 01")
        assert await client.ask(bytes.fromhex("10 000a 0002 04 0001 0000")) == bytes.fromhex("90 01"), (
            "part, and half"
        )
        assert await client.ask(bytes.fromhex("06 0064 0001")) == ILLEGAL_WRITE, (
            "an output, which it may not read"
        )
        assert await client.ask(bytes.fromhex("17 000a 0001 000b 0002 04 00000001")) == bytes.fromhex("97 01")
    event = [each for each in live_cell.events if each.kind is EventKind.REFUSED][-1]
    assert event.reason is not None
    assert event.reason.text == "its role has no right to it"


async def test_ownership_answers_06_to_a_role_that_may(
    listener: ModbusListener, certificates: Certificates
) -> None:
    operator = client_context(certificates, certificates.operator)
    setter = client_context(certificates, certificates.setter)
    async with dialled(listener, operator) as first, dialled(listener, setter, source="127.0.0.3") as second:
        assert await first.ask(WRITE) == WRITE
        assert await second.ask(WRITE) == bytes.fromhex("86 06")


async def test_locks_and_the_status_block_are_rights_too(
    listener: ModbusListener, certificates: Certificates, index_of: Callable[[str], int]
) -> None:
    def request(name: str) -> bytes:
        return bytes((6,)) + (60040).to_bytes(2, "big") + (index_of(name) + 1).to_bytes(2, "big")

    status = bytes.fromhex("03 ea60 0002")
    async with dialled(
        listener, client_context(certificates, certificates.setter), source="127.0.0.3"
    ) as client:
        assert await client.ask(request("part")) == request("part")
        assert await client.ask(request("count")) == ILLEGAL_WRITE
        assert (await client.ask(status))[0] == 3
    async with dialled(listener, client_context(certificates, certificates.viewer)) as client:
        assert await client.ask(request("part")) == ILLEGAL_WRITE
        assert (await client.ask(status))[0] == 3


async def test_a_role_with_an_address_has_to_come_from_there(
    listener: ModbusListener, certificates: Certificates
) -> None:
    context = client_context(certificates, certificates.setter)
    async with dialled(listener, context, source="127.0.0.4") as client:
        assert await client.ask(READ) == bytes.fromhex("03 02 0000")
        assert await client.ask(WRITE) == bytes.fromhex("86 02"), "no writer from there: ownership's 02"


async def test_a_writer_with_a_role_is_none_on_the_plain_port(
    plan: ModbusPlan, live_cell: Cell, events: list[PeerEvent]
) -> None:
    plain = ModbusListener("127.0.0.1", 0, observe=events.append)
    plain.serve([(plan, live_cell)])
    await plain.start()
    try:
        for source, answer in (("127.0.0.3", "86 02"), ("127.0.0.2", WRITE.hex())):
            reader, writer = await asyncio.open_connection("127.0.0.1", plain.port, local_addr=(source, 0))
            writer.write(frame(WRITE))
            assert (await reader.readexactly(7 + len(bytes.fromhex(answer))))[7:] == bytes.fromhex(answer)
            writer.close()
    finally:
        await plain.close()


# -- sessions -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
async def test_r42_a_resumed_session_keeps_the_role(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent], version: ssl.TLSVersion
) -> None:
    context = client_context(certificates, certificates.operator)
    context.minimum_version = context.maximum_version = version
    port = listener.port

    def twice() -> list[tuple[bool, bytes]]:
        found: list[tuple[bool, bytes]] = []
        session = None
        for _ in range(2):
            with socket.create_connection(("127.0.0.1", port)) as plain:
                plain.settimeout(10)
                with context.wrap_socket(plain, session=session) as tls:
                    tls.sendall(frame(WRITE))
                    found.append((bool(tls.session_reused), tls.recv(64)[7:]))
                    session = tls.session
        return found

    assert await asyncio.to_thread(twice) == [(False, WRITE), (True, WRITE)]
    shown = [event.credentials for event in events if event.kind is PeerEventKind.CONNECTED]
    assert [each.role for each in shown if each is not None] == ["operator", "operator"]


async def test_no_session_outlives_the_files_by_which_it_began(
    listener: ModbusListener, certificates: Certificates
) -> None:
    """A session is resumed without a look at the certificate: what was revoked meanwhile would not be seen."""
    context = client_context(certificates, certificates.operator)
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    port = listener.port

    def once(session: ssl.SSLSession | None) -> tuple[bool, ssl.SSLSession | None]:
        with socket.create_connection(("127.0.0.1", port)) as plain:
            plain.settimeout(10)
            with context.wrap_socket(plain, session=session) as tls:
                tls.sendall(frame(READ))
                assert tls.recv(64)
                return bool(tls.session_reused), tls.session

    _first, session = await asyncio.to_thread(once, None)
    certificates.authority.list_revoked()
    assert await renew_changed([listener]) == []
    assert (await asyncio.to_thread(once, session))[0] is False


async def test_r46_the_whole_chain_is_sent(listener: ModbusListener, certificates: Certificates) -> None:
    context = client_context(certificates, certificates.operator)
    async with dialled(listener, context) as client:
        chain = client.tls._sslobj.get_unverified_chain()  # type: ignore[attr-defined]  # public from 3.13 on
        assert len(chain) == 2


# -- records --------------------------------------------------------------------------------------------------------


async def test_two_requests_in_one_record(listener: ModbusListener, certificates: Certificates) -> None:
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        client.writer.write(frame(READ, 1) + frame(WRITE, 2))
        assert (await client.reader.readexactly(11))[:2] == bytes((0, 1))
        assert (await client.reader.readexactly(12))[:2] == bytes((0, 2))


async def test_one_request_over_two_records(listener: ModbusListener, certificates: Certificates) -> None:
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        request = frame(READ)
        client.writer.write(request[:5])
        await asyncio.sleep(0.02)
        client.writer.write(request[5:])
        assert await client.reader.readexactly(11)


async def test_more_requests_than_one_turn_takes(
    listener: ModbusListener, certificates: Certificates
) -> None:
    """Records of 16 KiB: more than is read at once, and answers in order."""
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        count = 4000
        client.writer.write(b"".join(frame(READ, number) for number in range(count)))
        answers = await client.reader.readexactly(11 * count)
        assert [int.from_bytes(answers[at : at + 2], "big") for at in range(0, len(answers), 11)] == list(
            range(count)
        )


async def test_what_is_no_modbus_ends_the_connection(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent]
) -> None:
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        client.writer.write(bytes(range(40)))
        assert await client.reader.read() == b""
    await until(lambda: events[-1].kind is PeerEventKind.DISCONNECTED)
    assert events[-1].reason.startswith("not Modbus TCP")


async def test_a_request_that_came_with_the_end_of_the_handshake_and_waited_is_not_carried_out(
    listener: ModbusListener,
    certificates: Certificates,
    live_cell: Cell,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A client with TLS 1.3 may ask before the gateway has read its certificate; then the process stands still."""
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = client_context(certificates, certificates.operator).wrap_bio(incoming, outgoing)
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)

    async def until_done(step: Callable[[], object]) -> object:
        while True:
            try:
                return step()
            except ssl.SSLWantReadError:
                writer.write(outgoing.read())
                incoming.write(await reader.read(65536))

    await until_done(client.do_handshake)
    client.write(frame(WRITE))
    now = clock.now()
    listener.gap(now - 30, now)
    writer.write(outgoing.read())
    monkeypatch.setattr(waiting, "SETTLING", 0.0)
    assert await until_done(lambda: client.read(100)) == frame(bytes.fromhex("86 06"))
    assert live_cell.last_refusal is not None
    assert live_cell.last_refusal.refusal.reason is Reason.WAITED
    writer.close()


# -- handshakes -----------------------------------------------------------------------------------------------------


async def test_plain_modbus_on_the_secured_port_is_told_so(
    listener: ModbusListener, events: list[PeerEvent]
) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)
    writer.write(frame(READ))
    with suppress(ConnectionError):
        await reader.read()
    writer.close()
    await until(lambda: bool(events))
    assert (events[-1].kind, events[-1].reason) == (
        PeerEventKind.UNSECURED,
        "what it sends is no TLS: the port without TLS is another one",
    )


async def test_a_handshake_that_is_not_finished_ends(
    listener: ModbusListener, events: list[PeerEvent], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(handshakes, "PATIENCE", 0.05)
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)
    writer.write(b"\x16\x03")
    assert await reader.read() == b""
    writer.close()
    assert events[-1].kind is PeerEventKind.UNFINISHED
    assert (listener.handshakes, listener.connections) == (0, 0)


async def test_half_handshakes_of_one_address_keep_nobody_out(
    listener: ModbusListener, certificates: Certificates
) -> None:
    flood = [
        await asyncio.open_connection("127.0.0.1", listener.port, local_addr=("127.0.0.9", 0))
        for _ in range(handshakes.MAX_OF_PEER + 5)
    ]
    try:
        await until(lambda: listener.refusals["unfinished"] == 5)
        assert listener.handshakes == handshakes.MAX_OF_PEER
        async with dialled(listener, client_context(certificates, certificates.operator)) as client:
            assert await client.ask(READ)
    finally:
        for _reader, writer in flood:
            writer.transport.abort()


async def test_a_connection_that_ends_during_its_handshake_is_counted(
    listener: ModbusListener, events: list[PeerEvent]
) -> None:
    _reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)
    writer.close()
    await until(lambda: listener.refusals["unsecured"] == 1)
    assert events[-1].reason == "closed by the peer"
    assert listener.handshakes == 0


async def test_an_expired_certificate_is_refused(
    listener: ModbusListener, certificates: Certificates, events: list[PeerEvent]
) -> None:
    old = certificates.authority.role("operator", "old", ends="20200101000000Z", key="ec")
    assert await refusal(listener, client_context(certificates, old)) == "SSLV3_ALERT_CERTIFICATE_EXPIRED"
    assert events[-1].reason == "certificate has expired"


# -- files that change ----------------------------------------------------------------------------------------------


async def test_a_revoked_client_is_ended_and_let_in_no_more(
    listener: ModbusListener, certificates: Certificates, live_cell: Cell, events: list[PeerEvent]
) -> None:
    lost = certificates.authority.role("operator", "lost", key="ec")
    stays = client_context(certificates, certificates.viewer)
    async with (
        dialled(listener, client_context(certificates, lost)) as client,
        dialled(listener, stays) as other,
    ):
        assert await client.ask(WRITE) == WRITE
        assert await other.ask(READ)
        certificates.authority.revoke(lost)
        assert await renew_changed([listener]) == []
        assert await client.ask(WRITE) == b""
        assert await other.ask(READ), "nobody else is dropped"
    ended = [event.reason for event in events if event.kind is PeerEventKind.DISCONNECTED]
    assert "its certificate was revoked" in ended
    assert live_cell.ownership.owners.count(None) == len(live_cell.ownership.owners)
    assert await refusal(listener, client_context(certificates, lost)) == "SSLV3_ALERT_CERTIFICATE_REVOKED"


async def test_who_has_the_number_of_a_revoked_certificate_from_another_authority_stays(
    plan: ModbusPlan, live_cell: Cell, certificates: Certificates, tmp_path: Path
) -> None:
    """The authorities of docs/howto/secure-modbus.md all begin with the same serial number."""
    assert plan.tls is not None
    old, new = Authority(tmp_path / "old", "Old"), Authority(tmp_path / "new", "New")
    gone, stays = (each.role("operator", key="ec") for each in (old, new))
    files = replace(plan.tls.files, clients=str(tmp_path / "clients"), revoked=str(tmp_path / "revoked"))

    def write() -> None:
        for name, kind in (("clients", "certificate"), ("revoked", "revoked")):
            parts = [getattr(each, kind).read_bytes() for each in (old, new)]
            (tmp_path / name).write_bytes(b"".join(parts))

    write()
    context = client_context(certificates, stays)
    async with (
        listening(replace(plan, tls=replace(plan.tls, files=files)), live_cell) as listener,
        dialled(listener, context) as client,
    ):
        assert await client.ask(READ)
        old.revoke(gone)
        write()
        assert await renew_changed([listener]) == []
        assert await client.ask(READ)
        assert await refusal(listener, context) == "served"
        assert (
            await refusal(listener, client_context(certificates, gone)) == "SSLV3_ALERT_CERTIFICATE_REVOKED"
        )


async def test_sessions_of_clients_without_tickets_are_kept_up_to_a_number(
    listener: ModbusListener, certificates: Certificates, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenSSL would keep 20480 of them, with certificates: hundreds of megabytes by a client that comes and goes."""
    context = client_context(certificates, certificates.viewer)
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    context.options |= ssl.OP_NO_TICKET
    monkeypatch.setattr(trust, "MAX_SESSIONS", 1)
    counts = []
    for _ in range(2):
        async with dialled(listener, context) as client:
            assert await client.ask(READ)
        assert await renew_changed([listener]) == []
        counts.append(listener.trust.context.session_stats()["number"])
    assert counts == [1, 0]


async def test_time_of_an_idle_connection_is_that_of_requests(
    plan: ModbusPlan, live_cell: Cell, certificates: Certificates
) -> None:
    context = client_context(certificates, certificates.viewer)
    async with (
        listening(replace(plan, idle_timeout=0.2), live_cell) as listener,
        dialled(listener, context) as client,
    ):
        assert await client.ask(READ)
        begun = time.monotonic()
        assert await client.reader.read() == b""
        assert time.monotonic() - begun > 0.1


# -- a reload -------------------------------------------------------------------------------------------------------


async def test_a_right_that_goes_releases_what_is_owned_by_it(
    listener: ModbusListener,
    plan: ModbusPlan,
    certificates: Certificates,
    live_cell: Cell,
    index_of: Callable[[str], int],
) -> None:
    """The reload says so before (`Link.departing`); the client stays connected, and is refused with 01 from then on."""
    assert plan.tls is not None
    unit = ModbusUnit(plan, live_cell)
    unit.listeners.append(listener)
    part, definition = index_of("part"), live_cell.definition
    narrowed = replace(plan.tls.roles[0], writable=(index_of("start"),))
    after = replace(plan, tls=replace(plan.tls, roles=(narrowed,)))
    listener._host, listener._port = plan.tls.host, plan.tls.port
    async with dialled(listener, client_context(certificates, certificates.operator)) as client:
        assert await client.ask(WRITE) == WRITE
        assert unit.departing(plan, definition) == {}
        (why,) = unit.departing(after, definition).values()
        assert why.startswith("role operator may not write ")
        unit.release(after, definition, time.monotonic())
        listener.serve([(after, live_cell)])
        assert live_cell.ownership.owners[definition.variables[part].lock or 0] is None
        assert await client.ask(WRITE) == ILLEGAL_WRITE
