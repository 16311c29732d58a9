"""A second RTDE client, in a thread: what the robot's inputs held, and when, by the controller's own clock.

It stays beside the gateway and knows nothing of it. If it is cut off it comes back; what was between is not seen, and
`watching` says so.
"""

from __future__ import annotations

import bisect
import math
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

_HEAD = struct.Struct(">HB")
_CODES = {"DOUBLE": "d", "INT32": "i", "UINT32": "I", "BOOL": "?", "UINT64": "Q", "UINT8": "B"}
_FREQUENCY = 500.0
_TIMEOUT = 1.0
_RETRY = 0.02
_SIGHT = 0.1
"""Seconds without a package after which something may have escaped it."""
_TICKS = 100_000
"""Readings of the controller's clock that are kept."""


class Change(NamedTuple):
    """From this moment on the input held this."""

    time: float
    """time.monotonic."""
    value: float
    blind: float
    """Seconds before `time` in which it may have come."""


class Witness(threading.Thread):
    """Watches from `start` until `stop`."""

    def __init__(self, host: str, port: int, fields: Sequence[str]) -> None:
        super().__init__(daemon=True)
        self._address = host, port
        self._fields = list(fields)
        self._over = threading.Event()
        self.changes: dict[str, list[Change]] = {field: [] for field in fields}
        self.spells: list[tuple[float, float]] = []
        """From when to when it was watching; the last spell grows."""
        self.ticks: deque[tuple[float, float]] = deque(maxlen=_TICKS)
        """When which timestamp of the controller came."""
        self._held: dict[str, float] = {}
        self._last = -math.inf
        """When the last package came."""
        self._anew = True
        """Whether a connection has just begun: one that was cut took with it what others had sent as well."""

    def run(self) -> None:
        while not self._over.is_set():
            try:
                with socket.create_connection(self._address, _TIMEOUT) as connected:
                    self._watch(connected)
            except (OSError, EOFError):
                time.sleep(_RETRY)

    def stop(self) -> None:
        self._over.set()
        self.join()

    def watching(self, since: float, until: float) -> bool:
        """Whether nothing can have escaped it between these moments."""
        return any(begin <= since and until <= end for begin, end in list(self.spells))

    def held(self, field: str, since: float = -math.inf) -> list[float]:
        """All values that the input had at or after a moment, in order, as far as seen."""
        changes = list(self.changes[field])
        first = max(0, bisect.bisect_right(changes, since, key=lambda change: change.time) - 1)
        return [change.value for change in changes[first:]]

    def timestamp(self, moment: float) -> float:
        """The newest timestamp of the controller that had come at this moment."""
        ticks = list(self.ticks)
        place = bisect.bisect_right(ticks, moment, key=lambda tick: tick[0])
        return ticks[place - 1][1] if place else -math.inf

    def _watch(self, connected: socket.socket) -> None:
        messages = _messages(connected)
        connected.sendall(_message(b"V", struct.pack(">H", 2)))
        _answer(messages, b"V")
        names = ",".join(["timestamp", *self._fields]).encode()
        connected.sendall(_message(b"O", struct.pack(">d", _FREQUENCY) + names))
        types = _answer(messages, b"O")[1:].decode().split(",")
        package = struct.Struct(">B" + "".join(_CODES[one] for one in types))
        connected.sendall(_message(b"S", b""))
        _answer(messages, b"S")
        self._anew = True
        for kind, payload in messages:
            if self._over.is_set():
                return
            if kind == b"U":
                self._take(*package.unpack(payload)[1:])

    def _take(self, timestamp: float, *values: float) -> None:
        now = time.monotonic()
        blind = now - self._last
        for field, value in zip(self._fields, values, strict=True):
            if value != self._held.get(field):
                self._held[field] = value
                self.changes[field].append(Change(now, value, blind))
        if self._anew or blind > _SIGHT:
            self._anew = False
            self.spells.append((now, now))
        self._last = now
        self.spells[-1] = (self.spells[-1][0], now)
        self.ticks.append((now, timestamp))


def _message(kind: bytes, payload: bytes) -> bytes:
    return _HEAD.pack(_HEAD.size + len(payload), kind[0]) + payload


def _messages(connected: socket.socket) -> Iterator[tuple[bytes, bytes]]:
    """Raises EOFError when the connection has ended."""
    with connected.makefile("rb") as stream:
        while True:
            head = stream.read(_HEAD.size)
            if len(head) < _HEAD.size:
                raise EOFError
            size, kind = _HEAD.unpack(head)
            payload = stream.read(size - _HEAD.size)
            if len(payload) < size - _HEAD.size:
                raise EOFError
            yield bytes((kind,)), payload


def _answer(messages: Iterator[tuple[bytes, bytes]], kind: bytes) -> bytes:
    return next(payload for found, payload in messages if found == kind)
