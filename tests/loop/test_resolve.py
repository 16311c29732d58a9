from __future__ import annotations

import asyncio
import socket
import threading
import time

import pytest

from gatewayd.loop.resolve import hosts, resolve


@pytest.mark.parametrize("host, family", [("127.0.0.1", socket.AF_INET), ("::1", socket.AF_INET6)])
async def test_numeric_addresses_need_no_thread(host: str, family: int) -> None:
    before = threading.active_count()
    ((found, kind, _, address),) = await resolve(host, 30004)
    assert (found, kind, address[:2]) == (family, socket.SOCK_STREAM, (host, 30004))
    assert threading.active_count() == before


async def test_names_are_looked_up() -> None:
    found = await resolve("localhost", 30004)
    assert {address[0] for *_, address in found} <= {"127.0.0.1", "::1"}


@pytest.mark.parametrize("host", ["a..b", "no host", "x" * 300])
async def test_what_is_no_host_name_is_told(host: str) -> None:
    with pytest.raises(socket.gaierror):
        await resolve(host, 30004)


def test_a_name_server_that_does_not_answer_does_not_hold_up_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop is closed while the look-up is still under way, and its answer comes to nobody."""
    release = threading.Event()
    genuine = socket.getaddrinfo

    def slow(host: str, port: int, *, type: int, flags: int = 0) -> object:  # noqa: A002  as the original
        if flags != socket.AI_NUMERICHOST:
            release.wait(10)
        return genuine("127.0.0.1" if flags == 0 else host, port, type=type, flags=flags)

    monkeypatch.setattr(socket, "getaddrinfo", slow)

    async def wait_a_little() -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.05):
                await resolve("robot.example", 30004)

    start = time.monotonic()
    asyncio.run(wait_a_little())
    assert time.monotonic() - start < 1.0
    release.set()


async def test_no_more_is_waited_than_there_is_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    release = threading.Event()

    def slow(*_arguments: object, flags: int = 0, **_settings: object) -> object:
        if flags != socket.AI_NUMERICHOST:
            release.wait(10)
        raise socket.gaierror(socket.EAI_NONAME, "nobody knows it")

    monkeypatch.setattr(socket, "getaddrinfo", slow)
    with pytest.raises(TimeoutError, match="timed out"):
        await resolve("robot.example", 30004, patience=0.05)
    release.set()


async def test_each_host_is_named_once() -> None:
    assert hosts(
        [*await resolve("127.0.0.1", 1), *await resolve("::1", 1), *await resolve("127.0.0.1", 2)]
    ) == [
        "127.0.0.1",
        "::1",
    ]
