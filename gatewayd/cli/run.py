"""`gatewayd run`: the daemon."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from gatewayd.daemon import Daemon

__all__ = ["command"]

FORCED = 130
"""Exit code after a second signal."""
NOTHING_TO_RUN = 1
UNREADABLE = 2


@click.command(
    name="run",
    epilog="""\b
Examples:
  gatewayd run my-cell.yaml
  gatewayd run /etc/gatewayd

\b
Exit codes:
  0    stopped by SIGTERM or SIGINT
  1    no mapping could be served (each reason stands in the log), or --strict and one of them could not
  2    wrong usage, or none of the files could be read
  130  forced by a second signal
""",
)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--log-format",
    type=click.Choice(["auto", "text", "json", "journal"]),
    default="auto",
    show_default=True,
    help="How a log line looks; auto: journal under systemd, else text.",
)
@click.option(
    "--log-level",
    type=click.Choice(["debug", "info", "warning", "error"]),
    default="info",
    show_default=True,
    help="Least severity told; debug also tells every lock taken and released.",
)
@click.option(
    "--state",
    type=click.Path(file_okay=False, path_type=Path),
    help="Directory of what CANopen masters have stored; default: $STATE_DIRECTORY, else ~/.local/state/gatewayd.",
)
@click.option("--strict", is_flag=True, help="Start only if every file can be served.")
def command(
    files: tuple[Path, ...], log_format: str, log_level: str, state: Path | None, *, strict: bool
) -> int:
    """Serve the robot cells of mapping FILES until stopped.

    A FILE may also be a directory: all its *.yaml files are meant. Cells with the same `modbus: listen:` share one
    listener and differ by their unit id. Robots, PLCs and interfaces may come and go in any order.
    """
    from gatewayd.daemon import Daemon
    from gatewayd.logs import Format, configure
    from gatewayd.startup import load_plans, state_directory

    configure(Format(log_format), logging.getLevelNamesMapping()[log_level.upper()])
    found = load_plans(files)
    if not found.plans and not found.broken:
        return UNREADABLE
    if not found.plans or (strict and (found.broken or found.unreadable)):
        return NOTHING_TO_RUN
    asyncio.run(_serve(Daemon(found.plans, state or state_directory(os.environ))))
    return 0


async def _serve(daemon: Daemon) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()

    def on_signal() -> None:
        if stop.is_set():
            os._exit(FORCED)
        stop.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, on_signal)
    await daemon.run(stop)
