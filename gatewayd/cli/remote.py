"""What the commands that talk to a running gateway share: options, errors with exit codes, completion of names."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from gatewayd.report.printable import json_text, printable, printable_answer

if TYPE_CHECKING:
    from gatewayd.control.client import Client

REFUSED, UNREACHABLE = 1, 2
"""Exit codes."""
_COMPLETION_PATIENCE = 0.5

_Complete = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


class RemoteError(click.ClickException):
    """The gateway refuses."""

    exit_code = REFUSED

    def __init__(self, error: Exception | str) -> None:
        super().__init__(printable(str(error)))


class Unreachable(RemoteError):
    """No gateway answers."""

    exit_code = UNREACHABLE


def on_gateway(command: Callable[..., None]) -> Callable[..., None]:
    """Give the command the running gateway as `client`, by the option `--socket`; what it refuses ends the command.

    A command of a group takes the group's --socket and --cell where it has none of its own.
    """

    @click.option(
        "--socket",
        type=click.Path(path_type=Path),
        envvar="GATEWAYD_CONTROL",
        is_eager=True,
        help="Control socket of the gateway. Default: that of the only gateway here.",
    )
    @wraps(command)
    def run(**options: Any) -> None:
        from gatewayd.control.client import Client

        group = click.get_current_context().parent
        for name, value in (group.params if group is not None else {}).items():
            if name in options:
                options[name] = options[name] or value
        client = Client(options.pop("socket"))
        with refusals(client, options.get("name") or ""):
            command(client=client, **options)

    return run


@contextmanager
def refusals(client: Client, name: str) -> Iterator[None]:
    """Turn what the client raises into an error of the command, with names close to `name` if there is none such."""
    from gatewayd.control.client import ControlError, NoDaemon

    try:
        yield
    except NoDaemon as error:
        raise Unreachable(error) from error
    except ControlError as error:
        # The interface names its field; people type an option.
        text = str(error).replace("say which with `cell`", "say which with --cell")
        kind = {"no_such_variable": "variables", "no_such_lock": "locks"}.get(error.code)
        if kind is not None:
            text += _meant(client, kind, name)
        raise RemoteError(text) from error


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
                f"{value!r} is not a duration: write a number with its unit, say 30s, 5min or 2h", param, ctx
            )
        return seconds


DURATION = Duration()


def _completing(kind: str, path: str, note: Callable[[Mapping[str, Any]], str]) -> _Complete:
    """Completes names of what the running gateway has, each with a note; nothing if it cannot be asked at once."""

    def complete(context: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from gatewayd.control.client import Client, ControlError, NoDaemon

        client = Client(context.params.get("socket"), _COMPLETION_PATIENCE)
        try:
            found = client.get(path, cell=context.params.get("cell"))[kind]
        except (NoDaemon, ControlError, OSError):
            return []
        # A shell would take what is not printable for something else.
        return [
            CompletionItem(item["name"], help=printable(note(item)))
            for item in found
            if item["name"].startswith(incomplete) and printable(item["name"]) == item["name"]
        ]

    return complete


complete_variables = _completing("variables", "/v1/variables", lambda variable: variable["robot"])
complete_locks = _completing("locks", "/v1/locks", lambda lock: lock["owner"] or "free")
_complete_cells = _completing("cells", "/v1/status", lambda _cell: "")


cell_option = click.option(
    "--cell",
    metavar="NAME",
    shell_complete=_complete_cells,
    help="Only this cell, where the gateway serves several.",
)
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print the answer of the gateway as JSON, for programs."
)
