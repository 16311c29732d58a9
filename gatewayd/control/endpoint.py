"""The Unix socket under the control interface: had when the gateway serves, kept while it runs, removed at its end.

Trouble with it never stops the gateway: it is reported once, and tried again. File permissions are the access control.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket
import stat
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from gatewayd.control.api import Api
from gatewayd.core.objection import ObjectionKind
from gatewayd.logs.records import fields
from gatewayd.loop.retry import reason_of, until_done

MODE = 0o660
"""Permissions of the socket: its owner and its group may do everything."""
RETRY_PERIOD = 2.0
"""Seconds between two attempts to have the socket, and between two looks whether it is still there."""
_SERVING_SOON = 0.02
_PROBE = 0.5

log = logging.getLogger("gatewayd.control")


class SocketTaken(OSError):
    """The socket cannot be had; the text says why and what to do."""


class Reloaded(Protocol):
    """What came of a reload."""

    @property
    def exit_code(self) -> int:
        """0 if what runs now is what the files say."""

    def as_object(self) -> Mapping[str, Any]:
        """What the client that asked for it reads."""


Reload = Callable[[frozenset[ObjectionKind]], Awaitable[Reloaded]]
"""Reload the mapping files; objections of these kinds are none."""


class Endpoint:
    """Serves `api` at `path` while `run` runs, from the moment that `is_serving` says that the gateway itself serves.

    The HTTP library is imported then, in a thread: the start never waits for it.
    """

    def __init__(
        self, path: Path, api: Api, is_serving: Callable[[], bool], reload: Reload | None = None
    ) -> None:
        self.path = path
        self._api = api
        self._is_serving = is_serving
        self._reload = reload

    async def run(self) -> None:
        """Serve until cancelled. A defect is logged, and the interface started again."""
        while not self._is_serving():  # noqa: ASYNC110 - nobody's event
            await asyncio.sleep(_SERVING_SOON)
        while True:
            await until_done(self._serve, Exception, self._report, RETRY_PERIOD)
            log.warning(
                "the control socket was removed, making a new one", extra=fields(socket=str(self.path))
            )

    def _report(self, error: Exception) -> None:
        if isinstance(error, OSError | ImportError):
            log.error("no control socket", extra=fields(socket=str(self.path), reason=reason_of(error)))
        else:
            log.exception("internal error, starting the control interface again")  # noqa: LOG004 - called by a handler

    async def _serve(self) -> None:
        """Serve until somebody removes the socket's file."""
        server = await asyncio.to_thread(import_module, "gatewayd.control.server")
        listening = await asyncio.to_thread(bind, self.path)
        inode = _inode(self.path)
        log.info("listening for control", extra=fields(socket=str(self.path)))
        try:
            async with server.serving(listening, self._api, self._reload):
                while inode is not None and _inode(self.path) == inode:  # noqa: ASYNC110 - nobody signals it
                    await asyncio.sleep(RETRY_PERIOD)
        finally:
            listening.close()
            if inode is not None and _inode(self.path) == inode:
                with suppress(OSError):
                    self.path.unlink()


def bind(path: Path) -> socket.socket:
    """A listening socket at `path`; one that a dead daemon left behind is replaced. Raises SocketTaken or OSError."""
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
    try:
        _make_room(path)
        former = os.umask(0o777 & ~MODE)
        try:
            listening.bind(str(path))
        finally:
            os.umask(former)
        listening.listen(16)
    except OSError as error:
        listening.close()
        if isinstance(error, SocketTaken):
            raise
        reason = error.strerror or str(error)
        raise SocketTaken(
            error.errno, f"{reason}; {_REMEDIES.get(error.errno or 0, 'see --control')}"
        ) from error
    return listening


_REMEDIES = {
    errno.ENOENT: "make the directory, or name another place with --control",
    errno.EACCES: "give the daemon's user the directory, or name another place with --control",
    errno.EADDRINUSE: "something else is there; name another place with --control",
}


def _make_room(path: Path) -> None:
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise SocketTaken(errno.EEXIST, "what is there is not a socket; name another place with --control")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(_PROBE)
        try:
            probe.connect(str(path))
        except (ConnectionRefusedError, FileNotFoundError):
            with suppress(FileNotFoundError):
                path.unlink()
        else:
            raise SocketTaken(
                errno.EADDRINUSE,
                "another gatewayd answers there; stop it, or name another place with --control",
            )


def _inode(path: Path) -> int | None:
    try:
        return path.stat().st_ino
    except OSError:
        return None
