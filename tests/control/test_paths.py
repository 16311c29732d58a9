"""Where daemon and commands look for the socket, so that they meet without being told."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.control import paths
from gatewayd.control.paths import SYSTEM_SOCKET, candidates, default_socket


def test_under_systemd_it_is_in_the_first_runtime_directory() -> None:
    environ = {"RUNTIME_DIRECTORY": "/run/gatewayd/press:/run/other", "XDG_RUNTIME_DIR": "/run/user/1"}
    assert default_socket(environ) == Path("/run/gatewayd/press/control.sock")


def test_in_a_session_daemon_and_commands_meet() -> None:
    environ = {"XDG_RUNTIME_DIR": "/run/user/1000"}
    assert default_socket(environ) == candidates(environ)[0] == Path("/run/user/1000/gatewayd.sock")


def test_the_service_is_found_without_a_session() -> None:
    assert candidates({}) == [SYSTEM_SOCKET]
    assert candidates({"XDG_RUNTIME_DIR": "relative"}) == [SYSTEM_SOCKET]


def test_what_a_service_runs_finds_its_own_daemon() -> None:
    """`ExecReload=` of one instance must not reload another."""
    environ = {"RUNTIME_DIRECTORY": "/run/gatewayd/press", "XDG_RUNTIME_DIR": "/run/user/1000"}
    assert candidates(environ) == [default_socket(environ)] == [Path("/run/gatewayd/press/control.sock")]


def test_without_a_place_of_its_own_there_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(paths, "SYSTEM_SOCKET", tmp_path / "missing" / "control.sock")
    assert default_socket({}) is None
    (tmp_path / "missing").mkdir()
    assert default_socket({}) == tmp_path / "missing" / "control.sock"
