"""Faults of browsers at the status listener."""

from __future__ import annotations

import socket
import time
from contextlib import ExitStack, suppress
from random import Random

from tests.e2e.processes import HOST
from tests.soak.cell import NAME
from tests.soak.rig import Rig

_PATHS = ("/metrics", f"/page/cells/{NAME}", "/api/v1/audit?limit=1000", "/api/v1/events?follow=1&limit=1000")
_HALF_OPEN = 50


def never_reads(rig: Rig, chance: Random) -> None:
    """Asks until nothing more fits into the connection, or for the endless answer; and keeps it."""
    with socket.socket() as peer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        peer.settimeout(5)
        peer.connect((HOST, rig.status))
        peer.setblocking(False)
        with suppress(OSError):
            request = _request(chance.choice(_PATHS))
            for _ in range(1000):
                peer.send(request * 20)
        time.sleep(chance.uniform(0.5, 2))


def half_requests(rig: Rig, chance: Random) -> None:
    """More connections than are allowed, none of which finishes its request."""
    with ExitStack() as all_of_them:
        for _ in range(_HALF_OPEN):
            request = _request(chance.choice(_PATHS))
            part = request[: chance.randrange(len(request))]
            with suppress(OSError):
                peer = all_of_them.enter_context(socket.create_connection((HOST, rig.status), 5))
                peer.sendall(part)
        time.sleep(chance.uniform(0.5, 2))


def _request(path: str) -> bytes:
    return f"GET {path} HTTP/1.1\r\nHost: {HOST}\r\n\r\n".encode()
