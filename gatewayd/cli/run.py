"""`gatewayd run`: the daemon."""

from __future__ import annotations

import logging
import os
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from gatewayd.service.compilation import Compilation
    from gatewayd.web.settings import Settings


@click.command(
    name="run",
    epilog="""\b
Examples:
  gatewayd run my-cell.yaml
  gatewayd run /etc/gatewayd

\b
Exit codes:
  0    stopped by SIGTERM, SIGINT or SIGQUIT, or by the end of its terminal; SIGHUP otherwise means: reload
  1    no mapping could be served (the log says why), or --strict and one of them could not
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
    help="Lowest severity that is logged; debug also logs every lock taken and released.",
)
@click.option(
    "--state",
    type=click.Path(file_okay=False, path_type=Path),
    help="Directory for what CANopen masters store; default: $STATE_DIRECTORY, else ~/.local/state/gatewayd.",
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
    help="Address of the status page, /metrics, /healthz and /readyz, say 127.0.0.1:9502. Off by default.",
)
@click.option(
    "--token-file",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_TOKEN_FILE",
    help="File of tokens (`gatewayd token`): what the status listener asks for where anything is changed, and beyond "
    "loopback for reading.",
)
@click.option(
    "--status-certificate",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_STATUS_CERTIFICATE",
    help="TLS certificate of the status listener with those of its issuers (PEM); beyond loopback it needs one.",
)
@click.option(
    "--status-key",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_STATUS_KEY",
    help="Private key of that certificate (PEM, not encrypted).",
)
@click.option(
    "--status-name",
    "names",
    metavar="NAME",
    multiple=True,
    envvar="GATEWAYD_STATUS_NAME",
    help="A name by which browsers call the status listener, beside its address and localhost; may be repeated.",
)
@click.option(
    "--status-proxy",
    "proxy",
    metavar="ADDRESS",
    envvar="GATEWAYD_STATUS_PROXY",
    help="Address of a reverse proxy that ends TLS in front of the status listener, and names its clients in "
    "X-Forwarded-For.",
)
@click.pass_obj
def command(
    early: Compilation | None,
    files: tuple[Path, ...],
    *,
    log_format: str,
    log_level: str,
    state: Path | None,
    control: Path | None,
    audit: Path | None,
    status: str | None,
    token_file: Path | None,
    status_certificate: Path | None,
    status_key: Path | None,
    names: tuple[str, ...],
    proxy: str | None,
    strict: bool,
) -> int:
    """Serve the robot cells of mapping FILES until stopped.

    A FILE may also be a directory, which stands for all its *.yaml and *.yml files. Cells with the same
    `modbus: listen:` share one listener and are told apart by their unit id. Robots, PLCs and
    interfaces may come and go in any order.
    """
    from gatewayd.service.main import main
    from gatewayd.service.options import Options

    page = _settings(status, token_file, status_certificate, status_key, names, proxy)
    options = Options(files, state, control, audit, page, strict=strict)
    with ExitStack() as log:
        return main(options, lambda: _configure(log, log_format, log_level), early)


def _configure(log: ExitStack, form: str, level: str) -> None:
    """Make the log, and have `log` end it."""
    from gatewayd.logs.records import Format, configure
    from gatewayd.logs.stream import LogStream

    stream = LogStream(_descriptor())
    log.callback(stream.close)
    configure(Format(form), logging.getLevelNamesMapping()[level.upper()], stream)
    log.callback(logging.shutdown)  # lines that were merged are written before the stream ends


def _settings(  # noqa: PLR0917 - one for each option
    status: str | None,
    token_file: Path | None,
    certificate: Path | None,
    key: Path | None,
    names: tuple[str, ...],
    proxy: str | None,
) -> Settings | None:
    if not status:
        given = {"--token-file": token_file, "--status-certificate": certificate, "--status-key": key}
        for option, path in given.items():
            if path is not None:
                variable = f"GATEWAYD_{option.removeprefix('--').replace('-', '_').upper()}"
                raise click.UsageError(
                    f"{option} {path} is for the status listener, and there is none: "
                    f"add --status 127.0.0.1:9502 (GATEWAYD_STATUS), or leave {option} ({variable}) out"
                )
        return None
    from gatewayd.web.settings import SettingsError, settings

    try:
        return settings(status, token_file, certificate, key, names, proxy)
    except SettingsError as error:
        raise click.UsageError(str(error)) from error


def _descriptor() -> int:
    """Standard error; nowhere if the process was started without: its number may belong to a PLC by now."""
    return os.open(os.devnull, os.O_WRONLY) if sys.stderr is None else sys.stderr.fileno()
