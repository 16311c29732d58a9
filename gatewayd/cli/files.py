"""Mapping files as commands take them: by path or from standard input."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from gatewayd.mapping.compiled import Unreadable
    from gatewayd.mapping.loader import Loaded
    from gatewayd.mapping.plan import Plan

STDIN = "-"
"""The file name that stands for standard input."""
_BROKEN, _UNREADABLE = 1, 2
"""Exit codes."""


def format_option(*formats: str, help: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:  # noqa: A002
    """`--format`, as `form`; the first is the default."""
    choice = click.Choice(formats)
    return click.option("--format", "form", type=choice, default=formats[0], show_default=True, help=help)


def name_of(file: str) -> str:
    """What a file is called in messages."""
    return "stdin" if file == STDIN else str(click.format_filename(file))


def read_file(file: str) -> bytes:
    """Its text; what exceeds the size limit is left out, so that `load` refuses it. Raises OSError, ValueError."""
    import sys
    from pathlib import Path

    from gatewayd.mapping.loader import read_bytes
    from gatewayd.mapping.source import MAX_BYTES

    return sys.stdin.buffer.read(MAX_BYTES + 1) if file == STDIN else read_bytes(Path(file))


def reason_of(error: OSError | ValueError) -> str:
    """Why a file cannot be read or written, in the operating system's words."""
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


def mapping_files(files: Iterable[str]) -> list[str]:
    """The files meant, each once, so that one named twice is one cell and not two that clash.

    A directory stands for its mapping files, as in `gatewayd run`; an empty one for itself.
    """
    from pathlib import Path

    from gatewayd.mapping.files import files_of

    named: list[str] = []
    for file in files:
        try:
            inside = files_of(Path(file)) if file != STDIN else []
        except OSError:
            inside = []
        named += map(str, inside) if inside else (file,)
    return list(dict.fromkeys(named))


def read_named(file: str) -> tuple[str, bytes | Unreadable]:
    """What the file is called in messages, and its text or why it cannot be read."""
    from gatewayd.mapping.compiled import Unreadable
    from gatewayd.mapping.files import PATTERNS

    name = name_of(file)
    try:
        return name, read_file(file)
    except IsADirectoryError:
        return name, Unreadable(name, f"no mapping file ({PATTERNS}) in this directory")
    except (OSError, ValueError) as error:
        return name, Unreadable(name, reason_of(error))


def load_file(file: str) -> Loaded | None:
    """The file, with its findings printed where they leave no plan; None after it was said why it cannot be read."""
    from gatewayd.mapping.loader import load
    from gatewayd.report.findings import CheckOutcome, as_text

    name = name_of(file)
    try:
        loaded = load(read_file(file), name)
    except (OSError, ValueError) as error:
        click.echo(printable(f"{name}: cannot be read: {reason_of(error)}"), err=True)
        return None
    if loaded.plan is None:
        click.echo(as_text(CheckOutcome((name,), loaded.diagnostics)), nl=False, err=True)
    return loaded


def load_plan(context: click.Context, file: str) -> tuple[Loaded, Plan]:
    """The file and its plan; ends the command, with the reason printed, where there is none."""
    loaded = load_file(file)
    if loaded is None:
        context.exit(_UNREADABLE)
    if loaded.plan is None:
        context.exit(_BROKEN)
    return loaded, loaded.plan
