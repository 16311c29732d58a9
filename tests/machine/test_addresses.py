from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from gatewayd.machine.addresses import resolved


async def test_an_address_is_itself_and_a_name_is_looked_up() -> None:
    assert await resolved("192.0.2.7") == ["192.0.2.7"]
    assert await resolved("::1") == ["::1"]
    assert set(await resolved("localhost")) & {"127.0.0.1", "::1"}


@pytest.mark.parametrize("host", ["no-such-host.invalid", "a" * 70, "two words"])
async def test_a_name_that_nobody_knows_is_an_error(host: str) -> None:
    with pytest.raises(OSError):
        await resolved(host)


@pytest.fixture
def hanging(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A name service that does not answer while the test runs."""
    release = threading.Event()
    answer = socket.getaddrinfo

    def wait(host: str, *_arguments: object, **settings: object) -> object:
        if not settings.get("flags"):
            release.wait(10)
        return answer("" if host == "slow" else host, 1, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr(socket, "getaddrinfo", wait)
    yield
    release.set()


@pytest.mark.usefixtures("hanging")
async def test_a_name_service_that_does_not_answer_is_not_waited_for() -> None:
    with pytest.raises(TimeoutError):
        await resolved("slow", patience=0.05)
