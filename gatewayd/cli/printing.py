"""Lines of commands: broken between words where a screen is narrower, whole for a pipe, a file or a log."""

from __future__ import annotations

import os
import sys

import click


def on_terminal() -> bool:
    """Whether a person looks at what is printed."""
    return sys.stdout.isatty()


def on_screen() -> bool:
    """Whether it is known how wide a table may be: by a terminal, or by COLUMNS."""
    return on_terminal() or "COLUMNS" in os.environ


def echo(line: str, *, broken: bool | None = None) -> None:
    """Print a line, which may have colours; `broken` where it is longer than the screen (None: on a terminal)."""
    if not (on_terminal() if broken is None else broken):
        click.echo(line)
        return
    from rich.console import Console
    from rich.text import Text

    from gatewayd.report.screen import wrapped

    text = Text.from_ansi(line)
    width = Console().width
    if len(text.plain) <= width:
        click.echo(line)
        return
    console = Console(highlight=False, markup=False, emoji=False, soft_wrap=True)
    for part in wrapped(text, width):
        console.print(part)
