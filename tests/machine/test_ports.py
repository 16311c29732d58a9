from __future__ import annotations

import errno
import os
import socket
from pathlib import Path

import pytest

from gatewayd.machine.ports import bind_failure, connect_error, holder, listening_inodes
from tests.e2e.processes import HOST, free_port


def test_a_free_port_stays_free() -> None:
    port = free_port()
    assert bind_failure(HOST, port) is None
    assert holder(port) == ""
    socket.create_server((HOST, port)).close()


@pytest.mark.parametrize("host", [HOST, "0.0.0.0"], ids=["own", "any"])
def test_a_taken_port_has_a_holder_with_its_name(host: str) -> None:
    with socket.create_server((HOST, free_port())) as taken:
        port = taken.getsockname()[1]
        failure = bind_failure(host, port)
        assert failure is not None
        assert failure.errno == errno.EADDRINUSE
        assert holder(port).endswith(f"(pid {os.getpid()})")


def test_what_ended_a_moment_ago_does_not_hold_its_port() -> None:
    """TIME_WAIT is no listener: a gateway may be started again at once."""
    with socket.create_server((HOST, free_port())) as server:
        port = server.getsockname()[1]
        with socket.create_connection((HOST, port)) as client:
            accepted, _ = server.accept()
            accepted.close()
            client.recv(1)
    assert bind_failure(HOST, port) is None


@pytest.mark.parametrize(
    "host, number", [("198.51.100.9", errno.EADDRNOTAVAIL), ("no-such-host.invalid", None), ("a" * 70, None)]
)
def test_an_address_of_another_machine_cannot_be_had(host: str, number: int | None) -> None:
    failure = bind_failure(host, free_port())
    assert failure is not None
    assert number is None or failure.errno == number


async def test_who_accepts_is_connected_to_once_and_left() -> None:
    with socket.create_server((HOST, free_port())) as server:
        assert await connect_error([HOST], server.getsockname()[1], 5) is None
        accepted, _ = server.accept()
        with accepted:
            assert accepted.recv(1) == b""


async def test_one_address_that_answers_is_enough() -> None:
    with socket.create_server((HOST, free_port())) as server:
        assert await connect_error(["127.0.0.2", HOST], server.getsockname()[1], 5) is None


async def test_who_refuses_says_so() -> None:
    failure = await connect_error([HOST], free_port(), 5)
    assert failure is not None
    assert failure.errno == errno.ECONNREFUSED
    assert await connect_error([], 1, 5) is not None


async def test_who_does_not_answer_is_not_waited_for() -> None:
    """A listener with a full queue, which drops what comes further."""
    with socket.socket() as full:
        full.bind((HOST, free_port()))
        full.listen(0)
        with socket.create_connection(full.getsockname()):
            failure = await connect_error([HOST], full.getsockname()[1], 0.05)
    assert failure is not None
    assert failure.errno == errno.ETIMEDOUT


def test_tables_that_cannot_be_read_are_nobody(tmp_path: Path) -> None:
    assert holder(502, tmp_path) == ""
    (tmp_path / "net").mkdir()
    (tmp_path / "net" / "tcp").write_text("head\n\n  0: nonsense\n")
    assert list(listening_inodes(502, tmp_path)) == []
