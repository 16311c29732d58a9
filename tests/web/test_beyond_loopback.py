"""The listener as it is beyond loopback: TLS, tokens for reading, roles, names and pages. Real sockets, real TLS."""

from __future__ import annotations

import asyncio
import json
import ssl
import subprocess
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import aiohttp
import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control.access import Role
from gatewayd.control.api import Api
from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.service.daemon import Daemon
from gatewayd.web import doors, guard
from gatewayd.web.access_control import AccessControl
from gatewayd.web.listener import PAGE, StatusListener
from gatewayd.web.probes import Probes
from gatewayd.web.settings import settings
from tests.machine.authority import OPENSSL, Authority
from tests.web.press import TOKEN, token, write_tokens

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")

VIEWER, OPERATING = "a viewer's token", "an operator's token"
OLD = "an old token"


@pytest.fixture
def tokens(tmp_path: Path) -> Path:
    return write_tokens(
        tmp_path / "tokens",
        token("anna", Role.ENGINEER, TOKEN),
        token("bert", Role.OPERATOR, OPERATING),
        token("prometheus", Role.VIEWER, VIEWER),
        token("old", Role.ENGINEER, OLD, -5.0),
    )


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority(tmp_path)


@asynccontextmanager
async def listening(access: AccessControl, probes: Probes, daemon: Daemon) -> AsyncIterator[StatusListener]:
    access.refresh()
    assert access.obstacle == ""
    listener = StatusListener(access, probes, (Api(daemon, Audit()), None))
    await listener.start()
    try:
        yield listener
    finally:
        await listener.close()


@pytest.fixture
def network(tokens: Path, authority: Authority, daemon: Daemon) -> AccessControl:
    """On every address, as a service on the plant's network would be."""
    certificate, key = authority.issue("gateway", "subjectAltName=DNS:gw1.plant.example,IP:127.0.0.1")
    options = settings("0.0.0.0:0", tokens, certificate, key, ["gw1.plant.example"])
    return AccessControl(options, lambda: daemon.cells)


@pytest.fixture
async def listener(network: AccessControl, probes: Probes, daemon: Daemon) -> AsyncIterator[StatusListener]:
    async with listening(network, probes, daemon) as found:
        yield found


def trusting(authority: Authority) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=str(authority.certificate))


@pytest.fixture
async def session(listener: StatusListener, authority: Authority) -> AsyncIterator[aiohttp.ClientSession]:
    """A client that verifies the certificate."""
    connector = aiohttp.TCPConnector(ssl=trusting(authority))
    async with aiohttp.ClientSession(f"https://127.0.0.1:{listener.port}", connector=connector) as found:
        yield found


async def ask(session: aiohttp.ClientSession, method: str, path: str, given: str = "", **headers: str) -> int:
    if given:
        headers["Authorization"] = f"Bearer {given}"
    async with session.request(method, path, headers=headers) as response:
        await response.read()
        return response.status


DATA = [
    "/metrics",
    "/page/cells",
    "/page/cells/press",
    "/page/cells/press/state",
    "/page/session",
    "/nothing",
]
DATA += [f"/api/v1/{name}" for name in ("status", "variables", "locks", "events", "audit", "version")]


async def test_nothing_is_read_without_a_token(session: aiohttp.ClientSession) -> None:
    for path in DATA:
        assert await ask(session, "GET", path) == 401, path
        assert await ask(session, "GET", path, OLD) == 401, path
        assert await ask(session, "GET", path, VIEWER) == (404 if path == "/nothing" else 200), path


async def test_the_pages_files_are_free_and_health_is_short(session: aiohttp.ClientSession) -> None:
    for path in PAGE:
        assert await ask(session, "GET", path) == 200
    for path, name in (("/healthz", "healthy"), ("/readyz", "ready")):
        async with session.get(path) as response:
            assert list(json.loads(await response.text())) == [name]
        async with session.get(path, headers={"Authorization": f"Bearer {VIEWER}"}) as response:
            assert "reasons" in json.loads(await response.text())


@pytest.mark.parametrize(
    "path, roles",
    [
        ("/api/v1/locks/spare/take", {OPERATING, TOKEN}),
        ("/api/v1/locks/spare/release", {OPERATING, TOKEN}),
        ("/api/v1/variables/cycles/force", {TOKEN}),
        ("/api/v1/variables/cycles/unforce", {TOKEN}),
        ("/api/v1/reload", {TOKEN}),
    ],
)
async def test_each_role_may_do_what_it_says(
    session: aiohttp.ClientSession, path: str, roles: set[str]
) -> None:
    for given in (VIEWER, OPERATING, TOKEN):
        headers = {"Authorization": f"Bearer {given}"}
        async with session.post(path, headers=headers, json={"for": 5, "value": 1}) as response:
            refused = response.status == 403 and (await response.json())["error"]["code"] == "role"
            assert refused is (given not in roles), (given, response.status)


async def test_who_did_it_is_known_everywhere(session: aiohttp.ClientSession, cell: Cell) -> None:
    headers = {"Authorization": f"Bearer {OPERATING}"}
    async with session.post("/api/v1/locks/spare/take", headers=headers, json={"for": 5}) as response:
        assert (await response.json())["by"] == "token bert"
    assert list(cell.events)[-1].detail == "by token bert from 127.0.0.1"
    async with session.get("/page/session", headers=headers) as response:
        caller = (await response.json())["caller"]
    assert (caller["name"], caller["role"]) == ("bert", "operator")
    assert 0 < caller["expires"] - time.time() <= 3600


@pytest.mark.parametrize(
    "host, status",
    [
        ("gw1.plant.example", 200),
        ("GW1.plant.example:9502", 200),
        ("127.0.0.1", 200),
        ("localhost:9502", 200),
        ("192.0.2.9", 421),
        ("evil.example", 421),
        ("gw1.plant.example.evil.example", 421),
        ("0.0.0.0", 421),
        ("gw1@evil", 421),
    ],
)
async def test_the_host_has_to_be_ours_on_every_address(
    session: aiohttp.ClientSession, host: str, status: int
) -> None:
    assert await ask(session, "GET", "/metrics", VIEWER, Host=host) == status
    assert await ask(session, "GET", "/healthz", Host=host) == status


@pytest.mark.parametrize(
    "headers, status",
    [
        ({}, 200),
        ({"Origin": "https://gw1.plant.example"}, 200),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-origin"}, 200),
    ],
)
async def test_a_page_of_another_site_changes_nothing(
    session: aiohttp.ClientSession, headers: dict[str, str], status: int
) -> None:
    given = {"Host": "gw1.plant.example", **headers}
    assert await ask(session, "POST", "/api/v1/locks/spare/take", TOKEN, **given) == status
    assert await ask(session, "GET", "/api/v1/events?follow=0", TOKEN, **given) == status
    assert await ask(session, "GET", "/metrics", TOKEN, **given) == 200


async def raw(listener: StatusListener, authority: Authority, request: bytes) -> bytes:
    context = trusting(authority)
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port, ssl=context)
    writer.write(request)
    try:
        return await asyncio.wait_for(reader.read(), 10)
    except ConnectionError:
        return b""
    finally:
        writer.close()


@pytest.mark.parametrize(
    "head, status",
    [
        (b"GET /healthz HTTP/1.1\r\nConnection: close\r\n\r\n", b"400"),
        (b"GET /healthz HTTP/1.0\r\n\r\n", b"400"),
        (b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil\r\nConnection: close\r\n\r\n", b"400"),
        (
            b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n"
            + 2 * b"Authorization: Bearer a\r\n"
            + b"Connection: close\r\n\r\n",
            b"400",
        ),
        (
            b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nAuthorization: \xff\xfe Bearer\r\nConnection: close\r\n\r\n",
            b"401",
        ),
        (b"\x16\x03\x01\x00\x00", b"400"),
    ],
)
async def test_hostile_headers_are_refused(
    listener: StatusListener, authority: Authority, head: bytes, status: bytes
) -> None:
    answer = await raw(listener, authority, head)
    assert answer[9:12] == status, answer
    assert b"Traceback" not in answer


async def test_no_token_is_in_the_log_whatever_the_request_is(
    listener: StatusListener, authority: Authority, network: AccessControl, caplog: pytest.LogCaptureFixture
) -> None:
    """aiohttp quotes a header that it cannot read, in the answer and in what it logs."""
    caplog.set_level("INFO")
    secret = b"gatewayd_" + 30 * b"s"
    for head in (
        b"Authorization: Bearer " + secret + b"\x00\r\n",
        b"Authorization : Bearer " + secret + b"\r\n",
        b"Authorization: Bearer " + 300 * secret + b"\r\n",
    ):
        answer = await raw(
            listener, authority, b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n" + head + b"\r\n"
        )
        assert answer[9:12] == b"400", answer
    assert network.refused["malformed"] == 3
    line = b"GET /%b HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer x\r\nConnection: close\r\n\r\n"
    assert (await raw(listener, authority, line % secret))[9:12] == b"401"
    logged = caplog.text + str([vars(record) for record in caplog.records])
    assert "gatewayd_..." in logged
    assert "sss" not in logged


@pytest.mark.parametrize("header", ["Content-Encoding: gzip", "Content-Type: text/plain; charset=nonsense"])
async def test_a_body_that_is_not_encoded_as_it_says_is_refused(
    listener: StatusListener, authority: Authority, caplog: pytest.LogCaptureFixture, header: str
) -> None:
    request = (
        "POST /api/v1/locks/spare/take HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
        f"Authorization: Bearer {TOKEN}\r\n{header}\r\nContent-Length: 5\r\n\r\nZZZZZ"
    )
    answer = await raw(listener, authority, request.encode())
    assert answer[9:12] == b"400", answer
    assert "ERROR" not in caplog.text


async def test_a_token_that_is_revoked_while_its_request_arrives_does_nothing(
    listener: StatusListener, authority: Authority, network: AccessControl, tokens: Path, cell: Cell
) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port, ssl=trusting(authority))
    head = (
        "POST /api/v1/variables/cycles/force HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
        f"Authorization: Bearer {TOKEN}\r\nExpect: 100-continue\r\nContent-Length: 23\r\n\r\n"
    )
    writer.write(head.encode())
    assert b"100 Continue" in await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 10)
    await asyncio.sleep(0.05)  # its header was judged
    write_tokens(tokens)
    network.refresh()
    writer.write(b'{"value": 1, "for": 60}')
    answer = await asyncio.wait_for(reader.read(), 10)
    writer.close()
    assert answer[9:12] == b"401", answer
    assert b"revoked" in answer
    assert not cell.forcing.forces
    assert network.refused["expired_token"] == 1


async def test_what_a_role_may_not_do_is_counted(
    session: aiohttp.ClientSession, network: AccessControl
) -> None:
    assert await ask(session, "POST", "/api/v1/locks/spare/take", VIEWER) == 403
    assert network.refused["role"] == 1


async def test_an_expired_token_is_slowed_down_and_logged_less_and_less(
    session: aiohttp.ClientSession, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A program that nobody gave a new one asks for years."""
    monkeypatch.setattr(guard, "MAX_DELAYED", 0)
    for _ in range(20):
        assert await ask(session, "GET", "/metrics", OLD) == 429
    assert caplog.text.count("counts no more") == 6


async def test_a_stream_goes_on_for_as_long_as_it_is_read(
    session: aiohttp.ClientSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doors, "PATIENCE", 0.3)
    monkeypatch.setattr(doors, "_SWEEP", 0.05)
    monkeypatch.setattr("gatewayd.control.server.ALIVE_PERIOD", 0.1)
    headers = {"Authorization": f"Bearer {VIEWER}"}
    begun = time.monotonic()
    async with session.get("/api/v1/events?follow=1", headers=headers) as response:
        async for _line in response.content:
            if time.monotonic() - begun > 1.0:
                return
    pytest.fail("the stream was ended")


async def test_a_stream_ends_with_its_token(
    session: aiohttp.ClientSession, network: AccessControl, tokens: Path
) -> None:
    headers = {"Authorization": f"Bearer {VIEWER}"}
    async with session.get("/api/v1/events?follow=1", headers=headers) as response:
        write_tokens(tokens)
        network.refresh()
        async with asyncio.timeout(5):
            await response.content.read()


async def test_a_revoked_token_ends_what_it_holds(
    session: aiohttp.ClientSession, network: AccessControl, tokens: Path, cell: Cell
) -> None:
    assert await ask(session, "POST", "/api/v1/locks/start/take", TOKEN) == 200
    lock = next(index for index, lock in enumerate(cell.definition.locks) if lock.name == "start")
    assert cell.ownership.owners[lock] == OPERATOR
    write_tokens(tokens)
    network.refresh()
    assert await ask(session, "POST", "/api/v1/locks/start/take", TOKEN) == 401
    assert network.credentials is not None
    assert network.credentials.end_what_ended(time.monotonic(), time.time()) == ["the token anna was revoked"]
    assert cell.ownership.owners[lock] is None


async def test_wrong_tokens_wait_and_the_right_one_never_does(
    session: aiohttp.ClientSession, network: AccessControl
) -> None:
    """From the same address: a client that guesses behind a NAT keeps nobody out."""
    for _ in range(3):
        network.wrong_tokens.wrong("127.0.0.1", time.monotonic())
    begun = time.monotonic()
    guesses = [asyncio.create_task(ask(session, "GET", "/metrics", "a guess")) for _ in range(3)]
    await asyncio.sleep(0)
    for _ in range(5):
        assert await ask(session, "GET", "/metrics", VIEWER) == 200
    assert time.monotonic() - begun < 1.5
    assert not any(guess.done() for guess in guesses)
    for guess in guesses:
        guess.cancel()


async def test_many_guesses_at_once_are_told_to_come_later(
    session: aiohttp.ClientSession,
    network: AccessControl,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(guard, "MAX_DELAYED", 0)
    for _ in range(20):
        assert await ask(session, "GET", "/metrics", "a guess") == 429
    assert network.refused["wrong_token"] == 20
    assert caplog.text.count("without the right token") == 6, "the first four, the eighth and the sixteenth"
    assert "a guess" not in caplog.text


def s_client(port: int, *options: str, text: str = "") -> str:
    assert OPENSSL is not None
    command = [OPENSSL, "s_client", "-connect", f"127.0.0.1:{port}", *options]
    done = subprocess.run(command, input=text, capture_output=True, text=True, timeout=20, check=False)
    return done.stdout + done.stderr


async def test_tls_1_2_and_1_3_and_nothing_older(listener: StatusListener) -> None:
    """By OpenSSL's own client, with its security level lowered so far that it would itself speak the old versions."""
    for version in ("-tls1_2", "-tls1_3"):
        shown = await asyncio.to_thread(s_client, listener.port, version, "-brief")
        assert "CONNECTION ESTABLISHED" in shown, shown
    for version in ("-tls1", "-tls1_1"):
        shown = await asyncio.to_thread(
            s_client, listener.port, version, "-brief", "-cipher", "ALL:@SECLEVEL=0"
        )
        assert "CONNECTION ESTABLISHED" not in shown, shown


async def test_plain_http_is_not_answered(listener: StatusListener, network: AccessControl) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)
    writer.write(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
    with suppress(ConnectionError):
        assert b"HTTP" not in await asyncio.wait_for(reader.read(), 10)
    writer.close()
    assert network.refused["handshake"] == 1


def test_a_certificate_that_no_client_can_use_leaves_the_former_one(network: AccessControl) -> None:
    """OpenSSL takes a key of this curve without complaint, and then has no cipher for it."""
    assert OPENSSL is not None
    assert network.identity is not None
    network.refresh()
    former, files = network.identity.context, network.identity.files
    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:secp256k1", "-nodes", "-keyout", str(files.key))
    command = [OPENSSL, "req", "-x509", *key, "-subj", "/CN=gateway", "-out", str(files.certificate)]
    subprocess.run(command, check=True, capture_output=True)
    network.refresh()
    assert "no client can use it" in network.identity.fault
    assert network.identity.context is former


async def test_another_certificate_is_presented_without_a_restart(
    listener: StatusListener, network: AccessControl, authority: Authority, session: aiohttp.ClientSession
) -> None:
    """Who is connected stays so."""
    assert await ask(session, "GET", "/metrics", VIEWER) == 200
    issued, key = authority.issue("successor", "subjectAltName=IP:127.0.0.1")
    assert network.identity is not None
    issued.replace(network.identity.files.certificate)
    key.replace(network.identity.files.key)
    network.refresh()
    assert await ask(session, "GET", "/metrics", VIEWER) == 200
    _reader, writer = await asyncio.open_connection("127.0.0.1", listener.port, ssl=trusting(authority))
    subject = writer.get_extra_info("peercert")["subject"]
    assert (("commonName", "successor"),) in subject
    writer.close()


async def test_handshakes_wait_for_their_turn_and_end(
    listener: StatusListener, session: aiohttp.ClientSession
) -> None:
    """Connections that say nothing, or nonsense, hold up nobody for long, and are bounded."""
    silent = [
        await asyncio.open_connection("127.0.0.1", listener.port, local_addr=("127.0.0.2", 0))
        for _ in range(40)
    ]
    for _reader, writer in silent[::2]:
        writer.write(b"\x16\x03\x01\x02\x00nonsense")
    assert await ask(session, "GET", "/metrics", VIEWER) == 200
    assert listener._doors is not None
    assert len(listener._doors._seen) <= doors.MAX_CONNECTIONS
    for _reader, writer in silent:
        writer.close()


@pytest.fixture
def behind(tokens: Path, daemon: Daemon) -> AccessControl:
    options = settings("127.0.0.1:0", tokens, names=["gw1.plant.example"], proxy="127.0.0.2")
    return AccessControl(options, lambda: daemon.cells)


async def test_behind_a_proxy_nobody_else_is_let_in_and_its_clients_are_known(
    behind: AccessControl, probes: Probes, daemon: Daemon, cell: Cell
) -> None:
    async with listening(behind, probes, daemon) as listener:
        connector = aiohttp.TCPConnector(local_addr=("127.0.0.2", 0))
        async with aiohttp.ClientSession(f"http://127.0.0.1:{listener.port}", connector=connector) as proxy:
            forwarded = {"X-Forwarded-For": "198.51.100.1, 192.0.2.7", "Host": "gw1.plant.example"}
            assert await ask(proxy, "GET", "/metrics", **forwarded) == 401
            assert await ask(proxy, "POST", "/api/v1/locks/spare/take", OPERATING, **forwarded) == 200
            assert list(cell.events)[-1].detail == "by token bert from 192.0.2.7"
        async with aiohttp.ClientSession(f"http://127.0.0.1:{listener.port}") as other:
            with pytest.raises(aiohttp.ClientError):
                await ask(other, "GET", "/healthz")
        assert behind.refused["peer"] >= 1
