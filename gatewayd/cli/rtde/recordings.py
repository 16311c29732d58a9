"""Recordings as commands of `gatewayd rtde` take them: options, progress, and what went wrong in one line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Self

import click
from click.core import ParameterSource

from gatewayd.cli.files import reason_of
from gatewayd.report.format import counted
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.rtde.recording import RecordingReader

FAILED, WRONG = 1, 2
"""Exit codes: what was to be done failed; wrong usage, or a file that cannot be read."""

_DELIMITERS = {"space": " ", "comma": ",", "semicolon": ";", "tab": "\t"}
_STEP = 0.01
"""Part of a file after which progress is shown anew."""


def _delimiter(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    from gatewayd.rtde.recording.writing import check_delimiter

    found = _DELIMITERS.get(value, value) if value is not None else None
    if found is not None:
        try:
            check_delimiter(found)
        except ValueError as error:
            raise click.BadParameter(str(error), context, parameter) from error
    return found


def delimiter_option(name: str, text: str, default: str | None = None) -> Callable[[Callable[..., Any]], Any]:
    """An option for what separates the columns of text: a sign, or one of the words for those that shells dislike."""
    return click.option(
        name,
        metavar="CHAR",
        callback=_delimiter,
        default=default,
        show_default=default is not None,
        help=text,
    )


def typed(context: click.Context, name: str) -> bool:
    """Whether an option stands in the command line, with whatever value: not its default, not the environment's."""
    return context.get_parameter_source(name) is ParameterSource.COMMANDLINE


@contextmanager
def reported(context: click.Context, *, remedy: str = "") -> Iterator[None]:
    """Ends the command where a recording cannot be read or written; `remedy` says how to overwrite what is there."""
    from gatewayd.rtde.recording import MissingExtraError, RecordingError, RecordingExistsError

    try:
        yield
    except RecordingError as error:
        exists = isinstance(error, RecordingExistsError)
        text = f"{error}{f', or {remedy}' if exists and remedy else ''}"
        click.echo(printable(text), err=True)
        context.exit(WRONG if exists or isinstance(error, MissingExtraError) else FAILED)
    except OSError as error:
        click.echo(printable(f"a recording cannot be read: {reason_of(error)}"), err=True)
        context.exit(FAILED)


class Progress:
    """A line on a terminal that says how far the reading of a recording is; nothing elsewhere."""

    def __init__(self) -> None:
        self._shown = 0.0
        self._visible = sys.stderr.isatty()

    def __call__(self, recording: RecordingReader, packages: int) -> None:
        """Show it, where it is worth it."""
        part = recording.position / recording.total if recording.total else 1.0
        if self._visible and part >= self._shown + _STEP:
            self._shown = part
            click.echo(f"\r{part:4.0%}, {counted(packages, 'package')}", nl=False, err=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        if self._shown:
            click.echo("\r\033[K", nl=False, err=True)
