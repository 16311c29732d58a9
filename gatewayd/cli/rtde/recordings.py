"""Recordings as commands of `gatewayd rtde` take them: options, progress, and what went wrong in one line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from gatewayd.cli.files import reason_of
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.rtde.recording import RecordingReader

FAILED, WRONG = 1, 2
"""Exit codes: what was to be done failed; wrong usage, or a file that cannot be read."""

_DELIMITERS = {"space": " ", "comma": ",", "semicolon": ";", "tab": "\t"}


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


@contextmanager
def reading_progress() -> Iterator[Callable[[RecordingReader, int], None]]:
    """Shows on a terminal how far the reading of a recording is, with the number of packages; nothing elsewhere."""
    from gatewayd.cli.rtde.progress import reading_line
    from gatewayd.cli.rtde.progress_lines import ProgressLines

    with ProgressLines(quiet=not sys.stderr.isatty()) as lines:
        yield lambda recording, packages: lines.show(
            reading_line(recording.position, recording.total, packages)
        )
