"""Lines that fit where they are printed."""

from __future__ import annotations

import pytest

from gatewayd.cli.printing import echo
from tests.report.test_screen import LINE


def test_a_pipe_gets_whole_lines(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    echo(LINE)
    assert capsys.readouterr().out == f"{LINE}\n"
    monkeypatch.setenv("COLUMNS", "40")
    echo(LINE)
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 40
