"""Reading many sockets with one callback of the event loop.

An event loop spends more on telling a protocol that its socket is readable than a register read takes. Here all
sockets of a listener are in an epoll set of their own, and the loop watches that set as one file descriptor.
"""

from __future__ import annotations

import asyncio
import select
from collections.abc import Callable

from gatewayd.loop import clock

_MAX_EVENTS = 32
"""Sockets looked at together."""
_LONGEST_TURN = 0.0002
"""Seconds after which other work of the loop has its turn, though more may have come in."""


class ReadPoller:
    """Calls a function for every socket that can be read; level-triggered."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._epoll = select.epoll()
        self._readers: dict[int, Callable[[], None]] = {}
        self._loop.add_reader(self._epoll.fileno(), self._turn)

    def add(self, descriptor: int, reader: Callable[[], None]) -> None:
        """Call `reader` whenever the socket has something to read, its end included."""
        self._readers[descriptor] = reader
        self._epoll.register(descriptor, select.EPOLLIN)

    def remove(self, descriptor: int) -> None:
        """Call no more for this socket; harmless for one that is not watched."""
        if self._readers.pop(descriptor, None) is not None:
            self._epoll.unregister(descriptor)

    def close(self) -> None:
        """Watch nothing any more."""
        self._readers.clear()
        if not self._epoll.closed:
            self._loop.remove_reader(self._epoll.fileno())
            self._epoll.close()

    def _turn(self) -> None:
        readers = self._readers
        now = clock.judged_now()
        end = now + _LONGEST_TURN
        # A client that waits for nothing has its next request under way by now: a look is cheaper than a sleep.
        while now < end and (events := self._epoll.poll(0, _MAX_EVENTS)):
            for descriptor, _events in events:
                reader = readers.get(descriptor)
                if reader is not None:
                    reader()
            now = clock.judged_now()
