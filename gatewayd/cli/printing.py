"""Lines of commands: broken between words where a screen is narrower, whole for a pipe, a file or a log."""

from __future__ import annotations

import os
import sys

import click


def on_screen() -> bool:
    """Whether it is known how wide lines may be: by a terminal, or by COLUMNS."""
    return sys.stdout.isatty() or "COLUMNS" in os.environ


def echo(line: str) -> None:
    """Print a line, which may have colours: broken where a screen is known to be narrower."""
    if not on_screen():
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
