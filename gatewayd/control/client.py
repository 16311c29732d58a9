"""The commands' side of the control interface: HTTP over the Unix socket, with nothing but the standard library."""

from __future__ import annotations

import http.client
import json
import os
import socket
from collections.abc import Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from gatewayd.control.paths import SYSTEM_SOCKET, candidates

_PATIENCE = 10.0
"""Seconds for an answer; a gateway that takes longer hangs."""
_FOLLOW_PATIENCE = 30.0
"""Seconds for a sign of life while following; the server gives one every 10 s."""


class NoDaemon(Exception):
    """No daemon answers; the text says where it was looked for and what to do."""


class ControlError(Exception):
    """The daemon refuses; `code` is for programs, the text for people, `body` the whole answer."""

    def __init__(self, status: int, code: str, message: str, body: Mapping[str, Any]) -> None:
        super().__init__(message)
        self.status, self.code, self.body = status, code, body


def find_socket(named: Path | None, environ: Mapping[str, str]) -> Path:
    """The socket that was named, the first of the usual ones that is there, or the only instance's. Raises NoDaemon."""
    if named is not None:
        return named
    usual = candidates(environ)
    found = next((path for path in usual if _is_there(path)), None)
    if found is None:
        instances = sorted(SYSTEM_SOCKET.parent.glob(f"*/{SYSTEM_SOCKET.name}"))
        if len(instances) == 1:
            return instances[0]
        if instances:
            raise NoDaemon(f"several run here: name one with --socket: {', '.join(map(str, instances))}")
        places = " or ".join(map(str, usual))
        raise NoDaemon(
            f"no gatewayd runs here: there is no {places}; start one, or name its socket "
            "with --socket (its log line `listening for control` has it)"
        )
    return found


def _is_there(path: Path) -> bool:
    """Also if it may be there, but this user may not look: then the attempt says so."""
    try:
        path.stat()
    except PermissionError:
        return True
    except OSError:
        return False
    return True


class Client:
    """One daemon's control socket, at `path` or else where one is found. Every call is a connection of its own."""

    def __init__(self, path: Path | None = None, patience: float = _PATIENCE) -> None:
        self._named = path
        self._patience = patience

    @cached_property
    def path(self) -> Path:
        """The socket; looked for when it is needed. Raises NoDaemon."""
        return find_socket(self._named, os.environ)

    def get(self, path: str, **query: str | int | None) -> dict[str, Any]:
        """Ask: `get("/v1/variables", name="tcp*")`. Raises NoDaemon, ControlError."""
        with self._answer("GET", _with_query(path, query)) as response:
            return self._read(response)

    def post(
        self, path: str, body: Mapping[str, Any] | None = None, *, patience: float | None = None
    ) -> dict[str, Any]:
        """Do: `post("/v1/locks/start/take", {"for": 60})`. Raises NoDaemon, ControlError."""
        with self._answer("POST", path, body or {}, patience) as response:
            return self._read(response)

    def follow(self, path: str, **query: str | int | None) -> Generator[dict[str, Any], None, None]:
        """Every object that comes, until the daemon ends. Raises NoDaemon, ControlError."""
        patience = max(self._patience, _FOLLOW_PATIENCE)
        with self._answer("GET", _with_query(path, query), patience=patience) as response:
            if response.status != http.client.OK:
                self._read(response)
            try:
                while line := response.readline():
                    if line.strip():
                        yield json.loads(line)
            except (OSError, http.client.HTTPException, ValueError):
                return

    @contextmanager
    def _answer(
        self, method: str, path: str, body: Mapping[str, Any] | None = None, patience: float | None = None
    ) -> Iterator[http.client.HTTPResponse]:
        connection = _UnixConnection(self.path, patience or self._patience)
        text = None if body is None else json.dumps(body)
        with closing(connection):
            try:
                connection.request(method, path, text, {"Content-Type": "application/json"} if text else {})
                response = connection.getresponse()
            except (OSError, http.client.HTTPException) as error:
                raise NoDaemon(_explain(self.path, error)) from error
            yield response

    def _read(self, response: http.client.HTTPResponse) -> dict[str, Any]:
        try:
            found = json.loads(response.read())
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise NoDaemon(f"what answers at {self.path} is not gatewayd") from error
        if response.status >= http.client.BAD_REQUEST:
            failure = found.get("error") or {}
            code, message = failure.get("code", "http"), failure.get("message", f"HTTP {response.status}")
            raise ControlError(response.status, code, message, found)
        return dict(found)


def segment(name: str) -> str:
    """A name as one segment of a path."""
    return quote(name, safe="")


class _UnixConnection(http.client.HTTPConnection):
    def __init__(self, path: Path, patience: float) -> None:
        super().__init__("localhost", timeout=patience)
        self._path = path

    def connect(self) -> None:
        """Connect to the socket file instead of to a host."""
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(os.fspath(self._path))


def _with_query(path: str, query: Mapping[str, str | int | None]) -> str:
    given = {name: str(value) for name, value in query.items() if value is not None}
    return f"{path}?{urlencode(given)}" if given else path


def _explain(path: Path, error: Exception) -> str:
    if isinstance(error, FileNotFoundError):
        return f"no gatewayd listens at {path}: no such file; is it running, and with this --control?"
    if isinstance(error, ConnectionRefusedError):
        return f"no gatewayd listens at {path} any more: start it again"
    if isinstance(error, PermissionError):
        return f"you may not use {path}: become a member of the socket's group (ls -l {path}), or use sudo"
    if isinstance(error, TimeoutError):
        return f"the gatewayd at {path} does not answer: see its log"
    return f"cannot talk to {path}: {error}"
