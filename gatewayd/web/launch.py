"""Brings the status listener up beside a daemon that serves already, and never in its way.

What is imported here late is imported in a thread, because the loop has packages to move meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
import stat
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from gatewayd.logs.records import fields
from gatewayd.loop.retry import keep_running, reason_of, until_done
from gatewayd.report.format import address
from gatewayd.service.daemon import Daemon
from gatewayd.web.probes import Probes

if TYPE_CHECKING:
    from gatewayd.control.api import Api
    from gatewayd.control.endpoint import Reload
    from gatewayd.web.listener import StatusListener

__all__ = ["MIN_TOKEN", "RETRY_PERIOD", "Settings", "SettingsError", "parse_address", "read_token", "serve"]

MIN_TOKEN = 16
"""Characters that a token must have."""
RETRY_PERIOD = 2.0
_LOOK = 0.05

log = logging.getLogger("gatewayd.status")


class SettingsError(ValueError):
    """An option that cannot be used; the text says what to do."""


class Settings:
    """Where to listen and what to ask for. Raises SettingsError."""

    def __init__(self, text: str, token_file: Path | None = None) -> None:
        self.host, self.port = parse_address(text)
        self.token = read_token(token_file) if token_file is not None else None


def parse_address(text: str) -> tuple[str, int]:
    """`127.0.0.1:9502`, `[::1]:9502`, `gateway.plant:9502`; `:9502` alone is loopback."""
    host, colon, port = text.rpartition(":")
    bare = host.removeprefix("[").removesuffix("]")
    bracketed = host.startswith("[") and host.endswith("]")
    if not (colon and port.isascii() and port.isdigit() and int(port) <= 0xFFFF) or (
        ":" in bare and not bracketed
    ):
        raise SettingsError(f"{text!r} is no address: use HOST:PORT, say 127.0.0.1:9502 or [::1]:9502")
    return bare or "127.0.0.1", int(port)


def read_token(path: Path) -> str:
    """The token: the file's only line. A file that others may read is refused."""
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise SettingsError(f"{path}: no ordinary file")
        if mode & (stat.S_IROTH | stat.S_IWOTH):
            raise SettingsError(f"{path}: others may read or change it; run: chmod o-rw {path}")
        with path.open("rb") as stream:
            text = stream.read(1024).decode().strip()
    except OSError as error:
        raise SettingsError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SettingsError(f"{path}: no text") from error
    if len(text) < MIN_TOKEN or not text.isascii() or not text.isprintable() or " " in text:
        raise SettingsError(
            f"{path}: a token is one word of at least {MIN_TOKEN} characters; make one: "
            f"head -c 24 /dev/urandom | base64 > {path}"
        )
    return text


async def serve(
    settings: Settings,
    daemon: Daemon,
    api: tuple[Api, Reload | None] | None = None,
    notes: Callable[[], Iterable[str]] = lambda: (),
) -> None:
    """Measure and listen until cancelled. An address that cannot be had is said once and tried again."""
    probes = Probes(daemon, notes)
    measuring = asyncio.create_task(probes.run())
    try:
        await _until_serving(daemon)
        await keep_running(
            lambda: _listen(settings, probes, api),
            log,
            RETRY_PERIOD,
            what="internal error, starting the status listener again",
        )
    finally:
        measuring.cancel()
        with suppress(asyncio.CancelledError):
            await measuring


async def _until_serving(daemon: Daemon) -> None:
    while not all(daemon.progress().values()):  # noqa: ASYNC110 - parts count, they have no event to wait for
        await asyncio.sleep(_LOOK)


async def _listen(settings: Settings, probes: Probes, api: tuple[Api, Reload | None] | None) -> None:
    module = await asyncio.to_thread(import_module, "gatewayd.web.listener")

    async def attempt() -> StatusListener:
        listener: StatusListener = module.StatusListener(
            settings.host, settings.port, probes, settings.token, api
        )
        await listener.start()
        return listener

    def report(error: Exception) -> None:
        log.error(
            "cannot listen for status requests",
            extra=fields(
                listen=address(settings.host, settings.port),
                reason=reason_of(error),
                retry_s=RETRY_PERIOD,
            ),
        )

    listener = await until_done(attempt, OSError, report, RETRY_PERIOD)
    log.info("status page", extra=fields(url=f"http://{address(settings.host, listener.port)}/"))
    try:
        await asyncio.get_running_loop().create_future()
    finally:
        await listener.close()
