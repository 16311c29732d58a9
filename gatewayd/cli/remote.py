"""What the commands that talk to a running gateway share: options, errors with exit codes, completion of names."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import CompletionItem

from gatewayd.report.printable import json_text, printable, printable_answer

if TYPE_CHECKING:
    from gatewayd.control.client import Client

__all__ = [
    "DURATION",
    "REFUSED",
    "UNREACHABLE",
    "Duration",
    "Refused",
    "Unreachable",
    "cell_option",
    "complete_cells",
    "complete_locks",
    "complete_variables",
    "connect",
    "echo_json",
    "json_option",
    "readable",
    "refusals",
    "socket_option",
]

REFUSED, UNREACHABLE = 1, 2
"""Exit codes."""
_COMPLETION_PATIENCE = 0.5

_Command = TypeVar("_Command", bound=Callable[..., Any])


class Unreachable(click.ClickException):
    """No gateway answers."""

    exit_code = UNREACHABLE

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


class Refused(click.ClickException):
    """The gateway does not do it."""

    exit_code = REFUSED

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


def connect(socket: Path | None) -> Client:
    """The gateway at the socket, or at one of the usual places. Raises Unreachable."""
    from gatewayd.control.client import Client, NoDaemon, find_socket

    try:
        return Client(find_socket(socket, os.environ))
    except NoDaemon as error:
        raise Unreachable(str(error)) from error


@contextmanager
def refusals(client: Client | None = None, name: str = "") -> Iterator[None]:
    """Turn what a client raises into an error of the command; with `client`, with names close to `name`."""
    from gatewayd.control.client import ControlError, NoDaemon

    try:
        yield
    except NoDaemon as error:
        raise Unreachable(str(error)) from error
    except ControlError as error:
        # The interface names its field; people type an option.
        text = str(error).replace("say which with `cell`", "say which with --cell")
        kind = _UNKNOWN.get(error.code)
        if client is not None and kind is not None:
            text += _meant(client, kind, name)
        raise Refused(text) from error


_UNKNOWN = {"no_such_variable": "variables", "no_such_lock": "locks"}


def _meant(client: Client, kind: str, name: str) -> str:
    """The names that come closest. Looked for here: the gateway has better things to do."""
    from difflib import get_close_matches

    from gatewayd.control.client import ControlError, NoDaemon

    try:
        names = sorted({found["name"] for found in client.get(f"/v1/{kind}")[kind]})
    except (NoDaemon, ControlError):
        return ""
    close = get_close_matches(name, names)
    return f"; did you mean {' or '.join(close)}?" if close else ""


def readable(answer: Any) -> Any:
    """What the gateway answered, for people: everything in it may go to a terminal. Programs get `echo_json`."""
    return printable_answer(answer)


def echo_json(answer: Any, *, indent: int | None = 2) -> None:
    """Print the answer as JSON with its exact content."""
    import json

    click.echo(json_text(json.dumps(answer, indent=indent, ensure_ascii=False)))


class Duration(click.ParamType):  # type: ignore[type-arg]
    """`30s`, `1.5min`, `200ms`, `2h`, as seconds."""

    name = "duration"
    _UNITS = {"ms": 0.001, "s": 1.0, "min": 60.0, "h": 3600.0}  # noqa: RUF012 - never changed
    _TEXT = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)\s*(ms|s|min|h)")

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Seconds; fails with a hint."""
        if isinstance(value, float):
            return value
        found = self._TEXT.fullmatch(str(value).strip())
        seconds = float(found[1]) * self._UNITS[found[2]] if found else 0.0
        if seconds <= 0:
            self.fail(
                f"{value!r} is no duration: write a number with its unit, say 30s, 5min or 2h", param, ctx
            )
        return seconds


DURATION = Duration()


def _names(context: click.Context, path: str, kind: str) -> list[dict[str, Any]]:
    """What the running gateway has; nothing if it cannot be asked at once."""
    from gatewayd.control.client import Client, ControlError, NoDaemon, find_socket

    try:
        client = Client(find_socket(context.params.get("socket"), os.environ), _COMPLETION_PATIENCE)
        found = client.get(path, cell=context.params.get("cell"))[kind]
        # A shell would take what is not printable for something else.
        return [thing for thing in found if printable(thing["name"]) == thing["name"]]
    except (NoDaemon, ControlError, OSError):
        return []


def complete_variables(
    context: click.Context, _param: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Names of variables, with what they are in the robot."""
    return [
        CompletionItem(variable["name"], help=printable(variable["robot"]))
        for variable in _names(context, "/v1/variables", "variables")
        if variable["name"].startswith(incomplete)
    ]


def complete_locks(context: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names of locks, with their owners."""
    return [
        CompletionItem(lock["name"], help=printable(lock["owner"] or "free"))
        for lock in _names(context, "/v1/locks", "locks")
        if lock["name"].startswith(incomplete)
    ]


def complete_cells(context: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names of cells."""
    found = _names(context, "/v1/status", "cells")
    return [CompletionItem(cell["name"]) for cell in found if cell["name"].startswith(incomplete)]


def socket_option(command: _Command) -> _Command:
    """`--socket`."""
    return click.option(
        "--socket",
        type=click.Path(path_type=Path),
        envvar="GATEWAYD_CONTROL",
        is_eager=True,
        help="Control socket of the gateway; found by itself where there is one.",
    )(command)


def cell_option(command: _Command) -> _Command:
    """`--cell`."""
    return click.option(
        "--cell",
        metavar="NAME",
        shell_complete=complete_cells,
        help="Only this cell, of several in one gateway.",
    )(command)


def json_option(command: _Command) -> _Command:
    """`--json`."""
    return click.option(
        "--json", "as_json", is_flag=True, help="Print what the gateway answers, for programs."
    )(command)
