"""Lines that fit where they are printed."""

from __future__ import annotations

import re

import pytest

from gatewayd.cli.printing import echo
from tests.cli.conftest import Invoke, Running
from tests.report.test_screen import LINE


@pytest.mark.parametrize("width", [40, 60, 72])
def test_a_terminal_gets_lines_that_fit(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    echo(LINE)
    assert capsys.readouterr().out == f"{LINE}\n", "a pipe gets them whole"
    monkeypatch.setattr("gatewayd.cli.printing.on_terminal", lambda: True)
    echo(LINE)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    assert " ".join(" ".join(lines).split()) == LINE.strip()


@pytest.mark.parametrize("width", [40, 60, 72, 80, 120])
@pytest.mark.parametrize("command", ["status", "events", "watch --once"])
def test_status_events_and_watch_once_fit(
    gateway: Running, invoke: Invoke, monkeypatch: pytest.MonkeyPatch, width: int, command: str
) -> None:
    gateway.do(lambda cell: cell.robot_lost("connection refused: its RTDE service may be off", 1.0))
    whole = invoke(*command.split()).output
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr("gatewayd.cli.printing.on_terminal", lambda: True)
    lines = invoke(*command.split()).output.splitlines()
    assert max(map(len, lines)) <= width
    words = re.sub(r"[0-9.:TZ-]+|ms|s|<1", "", " ".join(lines)).split()
    assert words == re.sub(r"[0-9.:TZ-]+|ms|s|<1", "", whole).split(), "nothing is lost"
