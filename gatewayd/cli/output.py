"""Files that commands write: none is overwritten unasked, each is whole, and what goes wrong is one line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import reason_of
from gatewayd.report.printable import printable
from gatewayd.whole_file import whole_file

if TYPE_CHECKING:
    from collections.abc import Callable

_CANNOT_BE_WRITTEN = 2
"""Exit code."""


def refuse_existing(*paths: str | Path, overwrite: bool) -> None:
    """UsageError for the first of the files that exists, without `overwrite`; asked before anything is done."""
    for path in paths:
        if not overwrite and Path(path).exists():
            raise click.UsageError(
                f"{click.format_filename(path)}: is there already; choose another name, "
                "or overwrite it with --force"
            )


def write_text(context: click.Context, path: str | Path, text: str, encoding: str = "utf-8") -> None:
    """Write a file with LF line ends; ends the command, with the reason printed, where that fails."""
    _written(context, path, lambda file: file.write_text(text, encoding=encoding, newline="\n"))


def write_bytes(context: click.Context, path: str | Path, content: bytes) -> None:
    """Write a file; ends the command, with the reason printed, where that fails."""
    _written(context, path, lambda file: file.write_bytes(content))


def _written(context: click.Context, path: str | Path, write: Callable[[Path], object]) -> None:
    try:
        with whole_file(path, overwrite=True) as unfinished:
            write(unfinished)
    except (OSError, ValueError) as error:
        message = f"{click.format_filename(path)}: cannot be written: {reason_of(error)}"
        click.echo(printable(message), err=True)
        context.exit(_CANNOT_BE_WRITTEN)
