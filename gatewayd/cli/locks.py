"""`gatewayd locks`: who owns what; take a lock as the local operator, or release one."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import click

from gatewayd.cli.printing import on_screen
from gatewayd.cli.remote import (
    DURATION,
    cell_option,
    complete_locks,
    echo_json,
    json_option,
    on_gateway,
    readable,
)

if TYPE_CHECKING:
    from gatewayd.control.client import Client


@click.group(
    name="locks",
    invoke_without_command=True,
    epilog="""\b
Examples:
  gatewayd locks
  gatewayd locks take motion --for 10min   whoever holds it; its writes are refused from now on
  gatewayd locks release motion            whoever holds it; the release fallback applies

\b
Exit codes:
  0  printed, taken, released
  1  refused
  2  wrong usage, or no gateway could be reached
""",
)
@on_gateway
@cell_option
@json_option
@click.pass_context
def command(context: click.Context, client: Client, cell: str | None, *, as_json: bool) -> None:
    """Print who owns what and for how long. Events and audit record with your name what you take or release."""
    if context.invoked_subcommand is not None:
        return
    locks = client.get("/v1/locks", cell=cell)["locks"]
    if as_json:
        echo_json(locks)
    else:
        _print(readable(locks))


@command.command(
    name="take",
    short_help="Take a lock from whoever holds it.",
    epilog="""\b
Examples:
  gatewayd locks take start                the PLC's writes to it are refused until you release it
  gatewayd locks take motion --for 10min   given back automatically
""",
)
@click.argument("name", shell_complete=complete_locks)
@click.option(
    "--for", "seconds", type=DURATION, metavar="TIME", help="Give it back after this time: 30s, 10min, 2h."
)
@on_gateway
@cell_option
def take(client: Client, name: str, seconds: float | None, cell: str | None) -> None:
    """Take lock NAME (of a variable or group) from whoever holds it, until it is released.

    What a writer held falls back to its on_release; what nobody held stays as it is.
    """
    from gatewayd.control.client import segment

    lock = readable(client.post(f"/v1/locks/{segment(name)}/take", {"for": seconds, "cell": cell}))
    until = "until you release it" if seconds is None else f"for {seconds:g} s"
    members = "" if lock["members"] == [lock["name"]] else f": {_members(lock)}"
    click.echo(f"{lock['name']} is the operator's {until}{members}")


@command.command(
    name="release",
    short_help="Release a lock, whoever holds it.",
    epilog="""\b
Examples:
  gatewayd locks release motion
""",
)
@click.argument("name", shell_complete=complete_locks)
@on_gateway
@cell_option
def release(client: Client, name: str, cell: str | None) -> None:
    """Release lock NAME, whoever holds it; the release fallbacks apply. A writer that keeps writing gets it back."""
    from gatewayd.control.client import segment

    lock = readable(client.post(f"/v1/locks/{segment(name)}/release", {"cell": cell}))
    click.echo(f"{lock['name']} is free")


def _print(locks: list[dict[str, Any]]) -> None:
    from gatewayd.report.format import age

    several = len({lock["cell"] for lock in locks}) > 1
    rows = [("lock", "owner", "left", "may own it", "variables")]
    for lock in locks:
        name = f"{lock['cell']}:{lock['name']}" if several else lock["name"]
        left = age(lock["remaining"]) if lock["remaining"] is not None else ""
        may = (" > " if lock["takeover"] else ", ").join(lock["owners"])
        members = "" if lock["members"] == [lock["name"]] else _members(lock)
        rows.append((name, lock["owner"] or "free", left, may, members))
    for place, lines in enumerate(_lined_up(rows)):
        colour = {"operator": "magenta", "free": None}.get(rows[place][1], "green") if place else None
        click.echo(click.style(lines, bold=not place, fg=colour))


def _lined_up(rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """The rows in columns, each broken between words where the terminal is narrow; those of a pipe are not."""
    from gatewayd.report.fitting import fitted, folded

    width = shutil.get_terminal_size().columns if on_screen() else sys.maxsize
    texts = {str(place): column for place, column in enumerate(zip(*rows, strict=True))}
    widths = list(fitted(texts, width - len(texts) + 1, ()).widths.values())
    for row in rows:
        cells = [folded(text, wide).split("\n") for text, wide in zip(row, widths, strict=True)]
        lines = ("  ".join(map(str.ljust, parts, widths)) for parts in zip_longest(*cells, fillvalue=""))
        yield "\n".join(line.rstrip() for line in lines)


def _members(lock: Mapping[str, Any]) -> str:
    from gatewayd.report.format import listed

    return listed(lock["members"], 5)
