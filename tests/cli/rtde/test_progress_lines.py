"""Progress on a terminal, and where there is none."""

from __future__ import annotations

import io
import sys

import pytest

from gatewayd.cli.rtde import progress_lines
from gatewayd.cli.rtde.progress_lines import ProgressLines


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown(monkeypatch: pytest.MonkeyPatch, stream: io.StringIO, *texts: str, quiet: bool = False) -> str:
    """What `stream` gets as standard error of something that shows its progress, and notes something at the end."""
    monkeypatch.setattr(progress_lines, "_TERMINAL_PERIOD", 0.0)
    monkeypatch.setattr(sys, "stderr", stream)
    with ProgressLines(quiet=quiet) as lines:
        for text in texts:
            lines.show(text)
        lines.note("noted")
        lines.show("last")
    return stream.getvalue()


def test_a_terminal_has_one_line_that_changes_and_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    text = shown(monkeypatch, Terminal(), "1 s", "2\ns", "x" * 1000)
    first, second, long, *rest = text.removeprefix("\r\033[K").split("\r\033[K")
    assert (first, rest) == ("1 s", ["noted\n", "last", ""])
    assert "\n" not in second
    assert set(long) == {"x"}
    assert len(long) < 1000


def test_elsewhere_a_line_comes_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, io.StringIO(), "1 s") == "noted\n"
    monkeypatch.setattr(progress_lines, "_LOG_PERIOD", 0.0)
    assert shown(monkeypatch, io.StringIO(), "1 s", "2 s") == "1 s\n2 s\nnoted\nlast\n"


def test_what_is_to_be_quiet_has_its_notes_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, Terminal(), "1 s", quiet=True) == "noted\n"
