"""`gatewayd run`: the daemon."""

from __future__ import annotations

import logging
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.service.signals import SIGNALS

if TYPE_CHECKING:
    import asyncio

    from gatewayd.service.daemon import Daemon
    from gatewayd.service.signals import Effect
    from gatewayd.service.startup import Startup
    from gatewayd.web.launch import Settings

__all__ = ["command"]

STOPPED = 0
NOTHING_TO_RUN = 1
UNREADABLE = 2
DEFECT = 70
"""Worth another attempt, unlike the others: the service manager starts it again."""


@click.command(
    name="run",
    epilog="""\b
Examples:
  gatewayd run my-cell.yaml
  gatewayd run /etc/gatewayd

\b
Exit codes:
  0    stopped by SIGTERM, SIGINT or SIGQUIT, or by the end of its terminal; SIGHUP otherwise means: reload
  1    no mapping could be served (each reason stands in the log), or --strict and one of them could not
  2    wrong usage, or none of the files could be read
  70   the process that reads the files could not do so; the log says why
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
@click.option(
    "--control",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_CONTROL",
    help="Control socket for gatewayd status, watch, force and so on; `none` for no socket. Default: in the runtime "
    "directory of the service or of the session.",
)
@click.option(
    "--audit",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_AUDIT",
    help="Also write the audit (who wrote what, when) to this file, as JSON lines, rotated by size.",
)
@click.option(
    "--status",
    metavar="HOST:PORT",
    envvar="GATEWAYD_STATUS",
    help="Listen there for the status page, /metrics, /healthz and /readyz, say 127.0.0.1:9502. Off by default.",
)
@click.option(
    "--token-file",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_TOKEN_FILE",
    help="File with the token that the status listener asks for by everything but reading.",
)
def command(
    files: tuple[Path, ...],
    *,
    log_format: str,
    log_level: str,
    state: Path | None,
    control: Path | None,
    audit: Path | None,
    status: str | None,
    token_file: Path | None,
    strict: bool,
) -> int:
    """Serve the robot cells of mapping FILES until stopped.

    A FILE may also be a directory: all its *.yaml files are meant. Cells with the same `modbus: listen:` share one
    listener and differ by their unit id. Robots, PLCs and interfaces may come and go in any order.
    """
    from gatewayd.logs.records import Format, configure
    from gatewayd.logs.stream import LogStream

    page = _settings(status, token_file) if status else None
    stream = LogStream(_descriptor())
    configure(Format(log_format), logging.getLevelNamesMapping()[log_level.upper()], stream)
    try:
        found = _load(files, strict=strict)
        if SIGNALS.stopping:
            _log_stop("stopped before anything was served")
            return STOPPED
        if isinstance(found, int):
            return found
        return _run(found, files, state, page=page, control=control, audit=audit)
    finally:
        stream.close()


def _settings(status: str, token_file: Path | None) -> Settings:
    # Its import brings the daemon's, which otherwise happens while the mapping files are read.
    from gatewayd.web.launch import Settings, SettingsError

    try:
        return Settings(status, token_file)
    except SettingsError as error:
        raise click.UsageError(str(error)) from error


def _descriptor() -> int:
    """Standard error; nowhere if the process was started without: its number may belong to a PLC by now."""
    return os.open(os.devnull, os.O_WRONLY) if sys.stderr is None else sys.stderr.fileno()


def _load(files: Sequence[Path], *, strict: bool) -> Startup | int:
    """What there is to serve, or the exit code."""
    from gatewayd.service.compilation import CompilationError
    from gatewayd.service.startup import load_plans

    try:
        found = load_plans(files, _import_the_daemon, lambda: SIGNALS.stopping)
    except CompilationError as error:
        if not SIGNALS.stopping:
            logging.getLogger("gatewayd.startup").error("%s", error)  # noqa: TRY400 - the text says it all
        return DEFECT
    if not found.plans and not found.broken:
        return UNREADABLE
    if not found.plans or (strict and (found.broken or found.unreadable)):
        return NOTHING_TO_RUN
    return found


def _run(
    found: Startup,
    files: Sequence[Path],
    state: Path | None,
    *,
    page: Settings | None,
    control: Path | None,
    audit: Path | None,
) -> int:
    import asyncio

    from gatewayd.loop import clock
    from gatewayd.service.daemon import Daemon
    from gatewayd.service.startup import state_directory

    daemon = Daemon(found.plans, state or state_directory(os.environ))
    with asyncio.Runner(loop_factory=clock.new_event_loop) as runner:
        runner.run(_serve(daemon, files, _notes(found), page=page, control=_socket(control), audit=audit))
    return STOPPED


def _log_stop(text: str) -> None:
    from gatewayd.logs.records import fields
    from gatewayd.service.signals import name_of

    logging.getLogger("gatewayd.run").info(text, extra=fields(signal=name_of(SIGNALS.stopped_by)))


def _import_the_daemon() -> None:
    """What takes as long as reading the files, and can be done meanwhile."""
    import gatewayd.service.daemon
    import gatewayd.service.operator
    import gatewayd.service.reload
    import gatewayd.service.watchdog  # noqa: F401


def _socket(named: Path | None) -> Path | None:
    from gatewayd.control.paths import default_socket
    from gatewayd.logs.records import fields

    if named is not None:
        return None if str(named) == "none" else named
    found = default_socket(os.environ)
    if found is None:
        log = logging.getLogger("gatewayd.control")
        log.warning(
            "no place for a control socket, gatewayd status and watch cannot ask this gateway",
            extra=fields(
                reason="neither a service nor a session (XDG_RUNTIME_DIR)",
                remedy="gatewayd run --control PATH",
            ),
        )
    return found


def _notes(found: Startup) -> list[str]:
    """What the service manager shows until a reload mends it."""
    count = found.broken + found.unreadable
    return [f"{count} mapping file{'s' if count > 1 else ''} not served, see the log"] if count else []


async def _serve(
    daemon: Daemon,
    files: Sequence[Path],
    notes: list[str],
    *,
    page: Settings | None,
    control: Path | None,
    audit: Path | None,
) -> None:
    import asyncio

    from gatewayd.loop import clock
    from gatewayd.service.operator import Operation, Standstill
    from gatewayd.service.reload import Reloader
    from gatewayd.service.systemd import Notifier
    from gatewayd.service.watchdog import Service
    from gatewayd.web.launch import serve

    stop = asyncio.Event()
    service = Service(Notifier(os.environ, os.getpid()), daemon, notes)
    reloader = Reloader(
        daemon, files, service.reload_begins, lambda outcome: service.reload_ended(outcome.notes)
    )
    SIGNALS.follow(asyncio.get_running_loop(), _Obedience(stop, reloader.ask))
    if stop.is_set():
        return
    standstill = Standstill()
    clock.on_gap(standstill.gap)
    operation = Operation(
        daemon,
        control,
        audit,
        lambda: service.notes,
        lambda force: reloader.reload(force=force),
        stood_still=standstill.seconds,
    )
    operating = asyncio.create_task(operation.run())
    reporting = asyncio.create_task(service.run(stop))
    reloading = asyncio.create_task(reloader.run())
    showing = (
        asyncio.create_task(serve(page, daemon, (operation.api, operation.reload), lambda: service.notes))
        if page
        else None
    )
    await daemon.run(stop)
    reloading.cancel()
    operating.cancel()
    if showing is not None:
        showing.cancel()
    await asyncio.wait((operating,))
    await reporting
    SIGNALS.leave()


class _Obedience:
    """Carries out what a signal asks for."""

    QUIET = 10.0
    """Seconds for which further signals of a kind that is ignored are not logged."""

    def __init__(self, stop: asyncio.Event, reload: Callable[[], None]) -> None:
        self._stop = stop
        self._reload = reload
        self._logged: dict[int, float] = {}

    def __call__(self, number: int, effect: Effect) -> None:
        from gatewayd.logs.records import fields
        from gatewayd.loop import clock
        from gatewayd.service.signals import Effect, name_of

        if effect is Effect.END:
            _log_stop("stopping")
            self._stop.set()
        elif effect is Effect.RELOAD:
            self._reload()
        elif clock.now() - self._logged.get(number, -math.inf) >= self.QUIET:
            self._logged[number] = clock.now()
            logging.getLogger("gatewayd.run").warning("signal ignored", extra=fields(signal=name_of(number)))
