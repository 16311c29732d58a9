"""`gatewayd events`: what has happened, and what happens."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from gatewayd.cli.printing import echo
from gatewayd.cli.remote import (
    DURATION,
    UNREACHABLE,
    cell_option,
    complete_variables,
    echo_json,
    json_option,
    on_gateway,
    readable,
)

if TYPE_CHECKING:
    from gatewayd.control.client import Client

_LAST = 20
"""Events that are printed where nothing says which."""
_ALL = 1000
"""Most that a gateway keeps for an answer."""


class PointInTime(click.ParamType):  # type: ignore[type-arg]
    """`10min` before now, or a time: `2026-11-22T02:15`, UTC unless it has a zone."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> datetime:
        """A time with its zone; fails with a hint."""
        if isinstance(value, datetime):
            return value
        from datetime import UTC

        try:
            found = datetime.fromisoformat(str(value))
        except ValueError:
            pass
        else:
            return found if found.tzinfo is not None else found.replace(tzinfo=UTC)
        try:
            return datetime.now(UTC) - timedelta(seconds=DURATION.convert(value, param, ctx))
        except (click.BadParameter, OverflowError):
            self.fail(
                f"{value!r} is not a time: write how long ago, say 10min or 2h, or when, say 2026-11-22T02:15Z",
                param,
                ctx,
            )


@dataclass(frozen=True, slots=True)
class EventFilter:
    """Which events are printed. What is not given chooses nothing."""

    since: datetime | None = None
    kinds: tuple[str, ...] = ()
    """Parts of their names, in lower case."""
    variables: tuple[str, ...] = ()
    """Names, with * and ?."""

    def __bool__(self) -> bool:
        return bool(self.since or self.kinds or self.variables)

    def __contains__(self, event: Mapping[str, Any]) -> bool:
        """Whether this event, or record of the audit, is."""
        name, what = event.get("variable") or "", event.get("event") or event["what"]
        return (
            (self.since is None or datetime.fromisoformat(event["time"]) >= self.since)
            and (not self.kinds or any(kind in what for kind in self.kinds))
            and (not self.variables or any(_names(name, pattern) for pattern in self.variables))
        )


def _names(name: str, pattern: str) -> bool:
    # Brackets are elements of a variable, not sets of characters.
    return name == pattern or fnmatchcase(name, pattern.replace("[", "[[]"))


def _known_kinds() -> list[str]:
    from gatewayd.core.events import EventKind
    from gatewayd.report.event_text import ACCEPTED

    return [*(kind.value for kind in EventKind), ACCEPTED]


def _complete_kinds(
    _context: click.Context, _param: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    return [CompletionItem(kind) for kind in _known_kinds() if incomplete.lower() in kind]


def _kinds(_context: click.Context, _param: click.Parameter, value: tuple[str, ...]) -> tuple[str, ...]:
    known = _known_kinds()
    for text in value:
        if not any(text.lower() in kind for kind in known):
            raise click.BadParameter(f"no event is called {text!r}; there are: {', '.join(known)}")
    return tuple(text.lower() for text in value)


@click.command(
    name="events",
    epilog="""\b
Examples:
  gatewayd events                          the last 20
  gatewayd events --since 2h --kind lost   what was lost in the last two hours
  gatewayd events --variable start         what happened to it; names may have * and ?
  gatewayd events --follow                 and everything that happens from now on
  gatewayd events --follow --json | jq -r 'select(.event=="write refused") | .variable'
  gatewayd events --audit --limit 100      who wrote what: old and new values

\b
Exit codes:
  0  printed
  1  refused
  2  wrong usage, or no gateway could be reached; with --follow also: the gateway has ended
""",
)
@on_gateway
@cell_option
@click.option("-f", "--follow", is_flag=True, help="Then print what happens from now on, until Ctrl-C.")
@click.option(
    "-n",
    "--limit",
    type=click.IntRange(0, _ALL),
    help="How many past events to print.  [default: 20; with --since all that are kept, 1000 at most]",
)
@click.option(
    "--since",
    type=PointInTime(),
    metavar="TIME",
    help="Only events since then: 10min or 2h ago, or 2026-11-22T02:15, in UTC unless it names a zone.",
)
@click.option(
    "--kind",
    "kinds",
    multiple=True,
    metavar="TEXT",
    callback=_kinds,
    shell_complete=_complete_kinds,
    help="Only events whose kind has this in its name, say lost or refused; may be repeated.",
)
@click.option(
    "--variable",
    "variables",
    multiple=True,
    metavar="NAME",
    shell_complete=complete_variables,
    help="Only events of this variable; may be repeated.",
)
@click.option("--audit", is_flag=True, help="Print the audit instead: accepted and refused writes.")
@json_option
@click.pass_context
def command(
    context: click.Context,
    client: Client,
    cell: str | None,
    *,
    follow: bool,
    limit: int | None,
    since: datetime | None,
    kinds: tuple[str, ...],
    variables: tuple[str, ...],
    audit: bool,
    as_json: bool,
) -> None:
    """Print the last events of the running gateway: links, locks, refusals, fallbacks, forces.

    Each has the time that it has in the log: date and time in UTC, with milliseconds.
    """
    if follow and audit:
        raise click.UsageError("--audit cannot be followed; gatewayd run --audit FILE writes a file that can")
    wanted = EventFilter(since, kinds, variables)
    if limit is None:
        limit = _LAST if since is None else _ALL
    for event in _found(client, cell, wanted, limit, follow=follow, audit=audit):
        _print(event, as_json=as_json)
    if follow:
        click.echo("the gateway has ended", err=True)
        context.exit(UNREACHABLE)


def _found(
    client: Client, cell: str | None, wanted: EventFilter, limit: int, *, follow: bool, audit: bool
) -> Iterable[Mapping[str, Any]]:
    """The last `limit` that are wanted; those that happen from now on after them."""
    if follow:
        return _following(client, cell, wanted, limit)
    asked = _ALL if wanted else limit
    path, part = ("/v1/audit", "records") if audit else ("/v1/events", "events")
    found = [event for event in client.get(path, limit=asked, cell=cell)[part] if event in wanted]
    return found[len(found) - min(limit, len(found)) :]


def _following(
    client: Client, cell: str | None, wanted: EventFilter, limit: int
) -> Iterator[Mapping[str, Any]]:
    """The stream begins with as many former events as hold the last `limit` that are wanted."""
    former = limit
    if wanted:
        before = client.get("/v1/events", limit=_ALL, cell=cell)["events"]
        at = [place for place, event in enumerate(before) if event in wanted]
        former = len(before) - at[max(0, len(at) - limit)] if at and limit else 0
    stream = client.follow("/v1/events", follow=1, limit=former, cell=cell)
    return (event for event in stream if event in wanted)


def _print(found: Mapping[str, Any], *, as_json: bool) -> None:
    if as_json:
        echo_json(found, indent=None)
        return
    found = readable(found)
    text = click.style(found["text"], fg="yellow" if found["bad"] else None)
    echo(f"{found['time']} {found['cell']}  {text}")
