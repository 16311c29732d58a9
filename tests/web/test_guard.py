"""What the listener lets in, over raw sockets where a client would be too polite."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import aiohttp
import pytest

from gatewayd.loop.share import Busy, LoopShare
from gatewayd.web import guard
from gatewayd.web.access_control import AccessControl
from gatewayd.web.guard import HEADERS
from gatewayd.web.listener import StatusListener
from gatewayd.web.settings import settings
from tests.web.press import TOKEN

Answer = tuple[int, str, dict[str, str]]


@pytest.fixture
async def session(listener: StatusListener) -> AsyncIterator[aiohttp.ClientSession]:
    async with aiohttp.ClientSession(f"http://127.0.0.1:{listener.port}") as found:
        yield found


async def ask(session: aiohttp.ClientSession, method: str, path: str, **headers: str) -> Answer:
    async with session.request(method, path, headers=headers) as response:
        return response.status, await response.text(), dict(response.headers)


@pytest.mark.parametrize("path", ["/", "/metrics", "/healthz", "/nothing", "/page/cells/nobody"])
async def test_every_answer_has_the_headers(session: aiohttp.ClientSession, path: str) -> None:
    _, _, headers = await ask(session, "GET", path)
    assert HEADERS.items() - {("Cache-Control", "no-store")} <= headers.items()
    assert "Python" not in headers["Server"]


@pytest.mark.parametrize(
    "given, status",
    [
        ({}, 401),
        ({"Authorization": "Bearer wrong"}, 401),
        ({"Authorization": f"Bearer {TOKEN}x"}, 401),
        ({"Authorization": "Bearer \xff"}, 401),
        ({"Authorization": f"Bearer {TOKEN}"}, 200),
    ],
)
async def test_changing_anything_needs_the_token(
    session: aiohttp.ClientSession, given: dict[str, str], status: int
) -> None:
    found = await ask(session, "POST", "/api/v1/locks/spare/take", **given)
    assert found[0] == status


READ = ["/", "/app.js", "/healthz", "/readyz", "/metrics", "/page/cells", "/page/cells/press"]
READ += ["/page/cells/press/state", "/nothing"]
READ += [
    f"/api/v1/{name}" for name in ("version", "status", "variables", "locks", "events", "audit", "nothing")
]
LONG = [path for path in READ if path not in ("/", "/app.js", "/healthz", "/nothing", "/api/v1/nothing")]


async def full(*_arguments: object) -> None:
    raise Busy


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "BUSY_DELAY", 0.0)


@pytest.mark.parametrize("path", READ)
async def test_whoever_reads_waits_for_his_turn(
    session: aiohttp.ClientSession, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.setattr(LoopShare, "request", full)
    status, text, _ = await ask(session, "GET", path)
    assert (status, text) == (503, "too many requests at once: try again later, and less often\n")


@pytest.mark.parametrize("path", LONG)
async def test_what_takes_time_is_done_in_turns(
    session: aiohttp.ClientSession, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.setattr(LoopShare, "done", full)
    assert (await ask(session, "GET", path))[0] == 503


async def test_a_wrong_token_waits_too_and_the_right_one_for_nobody(
    session: aiohttp.ClientSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LoopShare, "request", full)
    path = "/api/v1/locks/spare/take"
    assert (await ask(session, "POST", path, Authorization="Bearer wrong"))[0] == 503
    assert (await ask(session, "POST", path, Authorization=f"Bearer {TOKEN}"))[0] == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"])
async def test_only_reading_is_free(session: aiohttp.ClientSession, method: str) -> None:
    for path in ("/", "/metrics", "/api/v1/status", "/nothing"):
        assert (await ask(session, method, path))[0] == 401


@pytest.mark.parametrize(
    "host, served",
    [
        ("127.0.0.1", True),
        ("127.0.0.1:9502", True),
        ("[::1]:9502", True),
        ("localhost:1", True),
        ("evil.example", False),
        ("127.0.0.1.evil.example", False),
        ("localhost.evil.example:80", False),
    ],
)
async def test_a_name_that_was_led_here_reads_nothing(
    session: aiohttp.ClientSession, host: str, served: bool
) -> None:
    assert (await ask(session, "GET", "/metrics", Host=host))[0] == (200 if served else 421)


async def test_a_defect_shows_no_traceback(
    session: aiohttp.ClientSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_arguments: object) -> None:
        raise RuntimeError("secret detail")

    monkeypatch.setattr("gatewayd.web.listener.view.overview", fail)
    status, text, _ = await ask(session, "GET", "/page/cells")
    assert (status, text) == (500, "internal error, see the log of the gateway\n")


async def raw(port: int, request: bytes) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    try:
        return await asyncio.wait_for(reader.read(), 10)
    except ConnectionError:
        return b""
    finally:
        writer.close()


@pytest.mark.parametrize(
    "request_line",
    [
        b"\x00\x01\x00\x00\x00\x06\x01\x03\x00\x00\x00\x01",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"X: y\r\n" * 50_000 + b"\r\n",
        b"GET /../../etc/passwd HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n",
        b"POST /api/v1/reload HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999\r\nConnection: close\r\n\r\n",
    ],
    ids=["modbus", "long-path", "many-headers", "up-the-tree", "large-body"],
)
async def test_nonsense_is_refused_without_a_traceback(listener: StatusListener, request_line: bytes) -> None:
    answer = await raw(listener.port, request_line)
    assert answer[:12] in (
        b"",
        *(b"HTTP/1.%d %d" % (minor, code) for minor in (0, 1) for code in (400, 401, 404)),
    )
    assert b"Traceback" not in answer
    assert b"root:" not in answer


async def test_without_a_token_nothing_can_be_changed(listener: StatusListener) -> None:
    reading = StatusListener(AccessControl(settings("127.0.0.1:0")), listener._probes)
    await reading.start()
    try:
        async with aiohttp.ClientSession(f"http://127.0.0.1:{reading.port}") as session:
            status, text, _ = await ask(session, "POST", "/anything", Authorization="Bearer ")
    finally:
        await reading.close()
    assert (status, text) == (403, "reading only: the gateway was started without --token-file\n")
