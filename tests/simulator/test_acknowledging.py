"""When a client's machine counts as silent. What the kernel says is given; tests/standby_lab pulls real cables."""

from __future__ import annotations

import socket
import struct
from typing import cast

import pytest

from gatewayd.simulator.acknowledging import LOOK_PERIOD, Acknowledging


class Kernel:
    """A socket whose packets are not acknowledged."""

    def __init__(self) -> None:
        self.unacknowledged, self.last_heard = 0, 0

    def getsockopt(self, level: int, name: int, size: int) -> bytes:
        assert (level, name) == (socket.IPPROTO_TCP, socket.TCP_INFO)
        return struct.pack("=24xI28xI", self.unacknowledged, self.last_heard)[:size]


def silent_at(kernel: Kernel, *, limit: float, until: float) -> float | None:
    """When it counts as silent; its last acknowledgement ages meanwhile."""
    watch, before = Acknowledging(), kernel.last_heard
    for step in range(round(until / 0.008)):
        kernel.last_heard = before + step * 8
        if watch.silent(cast("socket.socket", kernel), step * 0.008, limit):
            return step * 0.008
    return None


@pytest.mark.parametrize("limit", [1.0, 10.0])
def test_it_is_silent_after_the_limit_and_no_later(limit: float) -> None:
    kernel = Kernel()
    kernel.unacknowledged = 3
    found = silent_at(kernel, limit=limit, until=limit + 1)
    assert found is not None
    assert limit <= found <= limit + 2 * LOOK_PERIOD


def test_who_is_sent_nothing_owes_nothing() -> None:
    assert silent_at(Kernel(), limit=1, until=20) is None


def test_the_time_before_something_was_sent_does_not_count() -> None:
    """The connection was idle for a minute: the first package has the whole time."""
    kernel = Kernel()
    kernel.unacknowledged, kernel.last_heard = 1, 60_000
    found = silent_at(kernel, limit=1, until=2)
    assert found is not None
    assert found >= 1


def test_who_acknowledges_now_and_then_is_not_silent() -> None:
    kernel, watch = Kernel(), Acknowledging()
    kernel.unacknowledged = 5
    for step in range(1000):
        kernel.last_heard = step * 20 % 900
        assert not watch.silent(cast("socket.socket", kernel), step * 0.02, 1.0)


def test_the_kernel_is_understood() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as near,
        server.accept()[0] as far,
    ):
        near.sendall(b"x")
        far.recv(1)
        watch = Acknowledging()
        assert not any(watch.silent(near, now, 0.1) for now in (0.0, 0.1, 0.2))
