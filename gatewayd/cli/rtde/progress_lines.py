"""The progress of what takes long, on standard error."""

from __future__ import annotations

import shutil
import sys
import time
from typing import Self

import click

from gatewayd.report.printable import printable

_TERMINAL_PERIOD, _LOG_PERIOD = 0.5, 10.0
"""Seconds between two lines of progress."""


class ProgressLines:
    """Progress on standard error: a line that changes on a terminal, now and then a new one elsewhere."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self._terminal = sys.stderr.isatty()
        self._next = 0.0 if self._terminal else time.monotonic() + _LOG_PERIOD
        self._drawn = False

    def show(self, text: str) -> None:
        """Show how far it is, where it is time."""
        now = time.monotonic()
        if self._quiet or now < self._next:
            return
        line = printable(text)
        if self._terminal:
            click.echo(f"\r\033[K{line[: _columns() - 1]}", nl=False, err=True)
            self._drawn = True
        else:
            click.echo(line, err=True)
        self._next = now + (_TERMINAL_PERIOD if self._terminal else _LOG_PERIOD)

    def note(self, line: str) -> None:
        """A line that stays."""
        self._clear()
        click.echo(printable(line), err=True)

    def _clear(self) -> None:
        if self._drawn:
            click.echo("\r\033[K", nl=False, err=True)
            self._drawn = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self._clear()


def _columns() -> int:
    return shutil.get_terminal_size().columns
