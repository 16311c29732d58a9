"""`gatewayd watch`: the variables of a running gateway, live in a terminal, or as lines for everything else."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from gatewayd.cli.printing import echo
from gatewayd.cli.remote import (
    DURATION,
    cell_option,
    complete_variables,
    on_gateway,
    readable,
)
from gatewayd.cli.terminal import ending_on_signals, keys, raw
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from rich.console import Console

    from gatewayd.cli.watching import Glimpse, View
    from gatewayd.control.client import Client

_EVENTS = 4


@click.command(
    name="watch",
    epilog="""\b
Keys:
  q quit, / filter, Esc clear, d direction, b only what is not good, space pause, arrows and PgUp PgDn scroll

\b
Examples:
  gatewayd watch
  gatewayd watch tcp              only names, registers and owners with tcp in them
  gatewayd watch --once           one snapshot, as lines
  gatewayd watch | tee log.txt    lines, every interval

\b
Exit codes:
  0  ended by q, Ctrl-C or --once
  1  refused
  2  wrong usage, or no gateway could be reached
""",
)
@click.argument("text", default="", shell_complete=complete_variables)
@click.option(
    "--interval",
    type=DURATION,
    default="500ms",
    show_default=True,
    metavar="TIME",
    help="Time between two updates.",
)
@click.option("--once", is_flag=True, help="Print once, as lines, and end.")
@on_gateway
@cell_option
@click.pass_context
def command(
    context: click.Context, text: str, client: Client, cell: str | None, *, interval: float, once: bool
) -> None:
    """Watch values, qualities, ages and owners live; TEXT filters them by name, robot register or owner."""
    from rich.console import Console

    from gatewayd.cli.watching import View

    console = Console(highlight=False)
    interval = max(0.1, interval)
    view = View(filter=text)
    first = _look(client, cell)
    # Ctrl-C is a way to end it, not to break it off; whatever else ends it leaves the terminal as it was.
    with suppress(KeyboardInterrupt), ending_on_signals():
        if once or not console.is_terminal or console.is_dumb_terminal or not sys.stdin.isatty():
            _lines(client, cell, first, view, interval=0.0 if once else interval)
        else:
            _live(console, lambda: _look(client, cell), first, view, interval)
    context.exit(0)


def _look(client: Client, cell: str | None) -> Glimpse:
    from gatewayd.cli.watching import Glimpse

    status = client.get("/v1/status")
    if cell is not None:
        status["cells"] = [found for found in status["cells"] if found["name"] == cell]
    variables = client.get("/v1/variables", cell=cell)["variables"]
    events = client.get("/v1/events", cell=cell, limit=_EVENTS)["events"]
    return Glimpse(*readable([status, variables, events]))


def _lines(client: Client, cell: str | None, first: Glimpse, view: View, interval: float) -> None:
    from gatewayd.cli.watching import plain

    _print(plain(first, view))
    while interval:
        time.sleep(interval)
        _print(plain(_look(client, cell), view))


def _print(lines: str) -> None:
    for line in lines.split("\n"):
        echo(line)


def _live(console: Console, look: Callable[[], Glimpse], first: Glimpse, view: View, interval: float) -> None:
    """Pictures in place until q. A gateway that goes away is waited for; what is shown meanwhile is marked as old."""
    from dataclasses import replace

    from rich.live import Live

    from gatewayd.cli.watching import press, screen, settled
    from gatewayd.control.client import ControlError, NoDaemon

    glimpse, before = first, None
    due = time.monotonic() + interval
    with raw(sys.stdin.fileno()), Live(console=console, screen=True, auto_refresh=False) as picture:
        while not view.over:
            width, height = console.size
            view = settled(view, glimpse, width, height)
            picture.update(screen(glimpse, before, view, width), refresh=True)
            for key in keys(sys.stdin.fileno(), max(0.0, due - time.monotonic())):
                view = press(view, key)
            if time.monotonic() < due:
                continue
            due = time.monotonic() + interval
            if not view.paused:
                try:
                    glimpse, before = look(), glimpse
                except (NoDaemon, ControlError) as error:
                    glimpse, before = replace(glimpse, lost=printable(str(error))), None
