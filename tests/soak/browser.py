"""Who looks at the status listener in the soak run, as a process: a browser with the page open, and a scraper.

    python -m tests.soak.browser HOST PORT CELL PAUSE

Each PAUSE seconds it asks for what the page asks and for /metrics, on one connection, and reads the events on another.
Being turned away or cut off is no trouble; an answer that reports a defect goes to standard error.
"""

from __future__ import annotations

import http.client
import json
import socket
import sys
import threading
import time
from contextlib import suppress

COMPLAINT = "unexpected:"
"""Begins each line about an answer that should not be."""
_GONE = (OSError, http.client.HTTPException)
_TIMEOUT = 5.0
_STREAM_TIMEOUT = 30.0
_RETRY = 0.1


def _ask(connection: http.client.HTTPConnection, path: str) -> bytes:
    connection.request("GET", path)
    response = connection.getresponse()
    body = response.read()
    if response.status != http.client.OK:
        _complain(path, f"{response.status}: {body[:200]!r}")
    return body


def _complain(path: str, answer: str) -> None:
    print(f"{COMPLAINT} {path} answered {answer}", file=sys.stderr, flush=True)


def _poll(connection: http.client.HTTPConnection, cell: str, pause: float) -> None:
    paths = (f"/page/cells/{cell}", f"/page/cells/{cell}/state?since=0", "/page/cells", "/api/v1/status")
    while True:
        for path in paths:
            try:
                json.loads(_ask(connection, path))
            except ValueError as error:
                _complain(path, f"no JSON: {error}")
        if b"gatewayd_info" not in (found := _ask(connection, "/metrics")):
            _complain("/metrics", f"{found[:200]!r}")
        time.sleep(pause)


def _follow(host: str, port: int) -> None:
    """Read the events; the listener ends each such connection after a while, and is asked again."""
    while True:
        with suppress(OSError), socket.create_connection((host, port), _STREAM_TIMEOUT) as stream:
            stream.sendall(f"GET /api/v1/events?follow=1 HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            while stream.recv(65536):
                pass
        time.sleep(_RETRY)


def _main(host: str, port: str, cell: str, pause: str) -> None:
    threading.Thread(target=_follow, args=(host, int(port)), daemon=True).start()
    while True:
        connection = http.client.HTTPConnection(host, int(port), timeout=_TIMEOUT)
        with suppress(*_GONE):
            _poll(connection, cell, float(pause))
        connection.close()
        time.sleep(_RETRY)


if __name__ == "__main__":
    _main(*sys.argv[1:])
