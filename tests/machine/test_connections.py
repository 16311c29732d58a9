from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from gatewayd.machine import connections
from tests.e2e.processes import HOST


@pytest.mark.parametrize(
    "host, family", [(HOST, socket.AF_INET), ("::1", socket.AF_INET6)], ids=["IPv4", "IPv6"]
)
def test_whoever_has_the_connection_is_named(host: str, family: socket.AddressFamily) -> None:
    try:
        server = socket.create_server((host, 0), family=family)
    except OSError:
        pytest.skip("no such address here")
    with server:
        address = (host, server.getsockname()[1])
        assert list(connections.connected_processes({address})) == [], "who listens has no connection to it"
        with socket.create_connection(address):
            found = list(connections.connected_processes({address}))
            assert [process.pid for process in found] == [os.getpid()]
            assert Path(found[0].command[0]).name.startswith(Path(sys.executable).name[:6])
            assert list(connections.connected_processes({(host, address[1] ^ 1)})) == []
    assert list(connections.connected_processes(())) == []


@pytest.mark.parametrize("hidden", [False, True], ids=["own", "another user's"])
def test_processes_whose_connections_cannot_be_seen_may_have_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hidden: bool
) -> None:
    (tmp_path / "net").mkdir()
    line = "0: 0100007F:A000 0A0200C0:7534 01 00000000:00000000 00:00000000 00000000 0 0 77 1"
    (tmp_path / "net" / "tcp").write_text(f"head\n{line}\n")
    process = tmp_path / "12"
    process.mkdir()
    (process / "cmdline").write_bytes(b"gatewayd\0run\0")
    (process / "fd").mkdir()
    address = ("192.0.2.10", 30004)
    if hidden:
        monkeypatch.setattr(connections, "socket_inodes", _refused)
    else:
        assert list(connections.connected_processes({address}, tmp_path)) == []
        (process / "fd" / "3").symlink_to("socket:[77]")
    found = list(connections.connected_processes({address}, tmp_path))
    assert found == [connections.ConnectedProcess(12, ("gatewayd", "run", ""))]


def _refused(process: Path) -> Iterator[str]:
    raise PermissionError(process)
