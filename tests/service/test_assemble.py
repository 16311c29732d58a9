"""What signals do to the process that was put together, and where its socket lies. The whole of it: tests/e2e."""

from __future__ import annotations

import asyncio
import signal
from pathlib import Path

import pytest

from gatewayd.control import paths
from gatewayd.loop import clock
from gatewayd.service.assemble import QUIET, SignalActions, control_socket
from gatewayd.service.signals import Effect


def test_without_a_place_for_the_socket_the_log_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    """`sudo gatewayd run` has no session: `gatewayd status` would say that nothing runs here."""
    monkeypatch.setattr(paths, "SYSTEM_SOCKET", tmp_path / "missing" / "control.sock")
    for name in ("RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"):
        monkeypatch.delenv(name, raising=False)
    assert control_socket(None) is None
    assert "--control" in str(caplog.records[0].__dict__["fields"])
    assert control_socket(Path("none")) is None
    assert len(caplog.records) == 1, "who asked for none is not told"


def test_signals_end_it_or_reload_and_what_is_ignored_is_logged_now_and_then(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "gatewayd.run")
    now, stop, reloads = clock.now(), asyncio.Event(), []
    monkeypatch.setattr(clock, "now", lambda: now)
    actions = SignalActions(stop, lambda: reloads.append(1))
    actions(signal.SIGHUP, Effect.RELOAD)
    assert (len(reloads), stop.is_set()) == (1, False)
    for _ in range(3):
        actions(signal.SIGUSR1, Effect.IGNORED)
    actions(signal.SIGUSR2, Effect.IGNORED)
    now += QUIET
    actions(signal.SIGUSR1, Effect.IGNORED)
    assert [record.__dict__["fields"]["signal"] for record in caplog.records] == [
        "SIGUSR1",
        "SIGUSR2",
        "SIGUSR1",
    ]
    actions(signal.SIGTERM, Effect.END)
    assert stop.is_set()
    assert caplog.records[-1].getMessage() == "stopping"
