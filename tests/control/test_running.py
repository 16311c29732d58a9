from __future__ import annotations

import socket
from pathlib import Path

import pytest

from gatewayd.control.running import RunningGateways, ask, sockets
from tests.cli.conftest import Running, gateway

__all__ = ["gateway"]
"""A fixture, from the tests of the commands."""


def test_all_usual_places_are_looked_at(tmp_path: Path) -> None:
    system = tmp_path / "run" / "control.sock"
    session = tmp_path / "session"
    for place in (system, session / "gatewayd.sock", system.parent / "second" / "control.sock"):
        place.parent.mkdir(exist_ok=True)
        place.touch()
    found = sockets(None, {"XDG_RUNTIME_DIR": str(session)}, system)
    assert found == [session / "gatewayd.sock", system.parent / "second" / "control.sock"]


def test_the_named_socket_is_the_only_one(tmp_path: Path) -> None:
    assert sockets(tmp_path / "none", {"XDG_RUNTIME_DIR": str(tmp_path)}) == [tmp_path / "none"]


def test_nowhere_a_gateway_is_nothing() -> None:
    assert ask([]) == RunningGateways()


def test_a_gateway_says_what_it_serves(gateway: Running) -> None:
    found = ask([gateway.path])
    assert found.sockets == (str(gateway.path),)
    (cell,) = found.cells
    assert (cell.name, cell.socket) == ("press", str(gateway.path))
    assert {variable["name"] for variable in cell.variables} >= {"start", "limit"}
    (robot,) = cell.links("Universal Robots controller")
    assert robot["address"] == "192.0.2.10:30004"


def test_a_socket_without_an_answer_has_its_reason(tmp_path: Path) -> None:
    (tmp_path / "old").touch()
    found = ask([tmp_path / "old", tmp_path / "none"])
    assert (found.sockets, found.cells) == ((), ())
    assert [place for place, _ in found.silent] == [str(tmp_path / "old"), str(tmp_path / "none")]


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}"])
def test_another_program_at_the_socket_is_none(tmp_path: Path, answer: bytes) -> None:
    import threading

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "other"))
        listener.listen()

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(65536)
                peer.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        found = ask([tmp_path / "other"])
        thread.join()
    assert (found.sockets, found.cells) == ((), ())
    assert len(found.silent) == 1
