"""The commands' client: where it looks, and what it says when nobody answers."""

from __future__ import annotations

import socket
import threading
from pathlib import Path

import pytest

from gatewayd.control import client, paths
from gatewayd.control.client import Client, NoDaemon, find_socket, segment


def test_a_named_socket_is_taken_as_it_is(tmp_path: Path) -> None:
    assert find_socket(tmp_path / "any", {}) == tmp_path / "any"


def test_the_sessions_socket_is_found(tmp_path: Path) -> None:
    (tmp_path / "gatewayd.sock").touch()
    assert find_socket(None, {"XDG_RUNTIME_DIR": str(tmp_path)}) == tmp_path / "gatewayd.sock"


def test_without_a_daemon_the_places_are_named(tmp_path: Path) -> None:
    with pytest.raises(NoDaemon, match=r"there is no .*gatewayd\.sock or /run/gatewayd/control\.sock"):
        find_socket(None, {"XDG_RUNTIME_DIR": str(tmp_path)})


def test_a_socket_behind_a_closed_door_is_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the user is told about the group, not that nothing runs."""

    def closed(_path: Path) -> None:
        raise PermissionError

    monkeypatch.setattr(Path, "stat", closed)
    assert find_socket(None, {"XDG_RUNTIME_DIR": str(tmp_path)}) == tmp_path / "gatewayd.sock"


def test_the_only_instance_is_found_and_of_several_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (client, paths):
        monkeypatch.setattr(module, "SYSTEM_SOCKET", tmp_path / "control.sock")
    (tmp_path / "press").mkdir()
    (tmp_path / "press" / "control.sock").touch()
    assert find_socket(None, {}) == tmp_path / "press" / "control.sock"
    (tmp_path / "weld").mkdir()
    (tmp_path / "weld" / "control.sock").touch()
    with pytest.raises(NoDaemon, match=r"name one with --socket: .*press.*weld"):
        find_socket(None, {})


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(NoDaemon, match="no such file"):
        Client(tmp_path / "none").get("/v1/version")


def test_a_dead_socket(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(tmp_path / "dead"))
    with pytest.raises(NoDaemon, match="any more: start it again"):
        Client(tmp_path / "dead").get("/v1/version")


@pytest.mark.parametrize("says", [b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\nxyz", b"SSH-2.0-x\r\n", b""])
def test_somebody_else_answers(tmp_path: Path, says: bytes) -> None:
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(tmp_path / "other"))
        other.listen()

        def answer() -> None:
            peer, _ = other.accept()
            with peer:
                peer.recv(4096)
                peer.sendall(says)

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(NoDaemon):
            Client(tmp_path / "other").get("/v1/version")
        thread.join()


def test_one_that_hangs(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as hung:
        hung.bind(str(tmp_path / "hung"))
        hung.listen()
        with pytest.raises(NoDaemon, match="does not answer: see its log"):
            Client(tmp_path / "hung", patience=0.05).get("/v1/version")


def test_a_segment_hides_what_would_be_a_path() -> None:
    assert segment("tcp[0]/x?") == "tcp%5B0%5D%2Fx%3F"
