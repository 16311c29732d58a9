"""Reading many sockets with one callback of the event loop.

An event loop spends more on telling a protocol that its socket is readable than a register read takes. Here all
sockets of a listener are in an epoll set of their own, and the loop watches that set as one file descriptor.

Nobody's requests are served at the cost of the others: declared writers come first in each turn, then everybody in the
order in which they came, a little of each, and the loop's other work in between.
"""

from __future__ import annotations

import asyncio
import select
from collections.abc import Callable

from gatewayd.loop import clock

_MAX_EVENTS = 128
"""Sockets looked at together."""
_LONGEST_TURN = 0.0002
"""Seconds after which other work of the loop has its turn, though more may have come in."""

Reader = Callable[[], object]
"""Serves a little of what has come in; true: it has more that was read already, and is to be called again."""
_Queue = dict[int, None]
"""Descriptors in the order in which they are to be served."""


class ReadPoller:
    """Calls a function for every socket that can be read; level-triggered."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._epoll = select.epoll()
        self._readers: dict[int, Reader] = {}
        self._preferred: set[int] = set()
        self._first: _Queue = {}
        self._others: _Queue = {}
        self._soon: asyncio.Handle | None = None
        """The next turn, if it does not wait for a socket."""
        self._loop.add_reader(self._epoll.fileno(), self._turn)

    def add(self, descriptor: int, reader: Reader, *, preferred: bool = False, again: bool = False) -> None:
        """Call `reader` whenever the socket has something to read, its end included; `again`: before that, too."""
        self._readers[descriptor] = reader
        self.prefer(descriptor, preferred=preferred)
        self._epoll.register(descriptor, select.EPOLLIN)
        if again:
            self._queue(descriptor)[descriptor] = None
            self._call_soon()

    def prefer(self, descriptor: int, *, preferred: bool) -> None:
        """Serve the socket before those that are not preferred; harmless for one that is not watched."""
        if preferred and descriptor in self._readers:
            self._preferred.add(descriptor)
        else:
            self._preferred.discard(descriptor)

    def remove(self, descriptor: int) -> None:
        """Call no more for this socket; harmless for one that is not watched."""
        if self._readers.pop(descriptor, None) is not None:
            self._epoll.unregister(descriptor)
            self._preferred.discard(descriptor)
            self._first.pop(descriptor, None)
            self._others.pop(descriptor, None)

    def close(self) -> None:
        """Watch nothing any more."""
        self._readers.clear()
        if self._soon is not None:
            self._soon.cancel()
        if not self._epoll.closed:
            self._loop.remove_reader(self._epoll.fileno())
            self._epoll.close()

    def _turn(self) -> None:
        if self._soon is not None:
            return  # it comes in this turn of the loop, too
        readers, first, others = self._readers, self._first, self._others
        now = clock.judged_now()
        end = now + _LONGEST_TURN
        # A client that waits for nothing has its next request under way by now: a look is cheaper than a sleep.
        while now < end:
            events = self._epoll.poll(0, _MAX_EVENTS)
            if len(events) == 1 and not first and not others:  # the usual case, made quick
                descriptor = events[0][0]
                if (reader := readers.get(descriptor)) is not None and reader():
                    self._queue(descriptor)[descriptor] = None
                now = clock.judged_now()
                continue
            for descriptor, _events in events:
                self._queue(descriptor)[descriptor] = None
            if not first and not others:
                return
            for queue in (first, others):
                if queue:
                    now = self._serve(queue, end)
        if first or others:
            self._call_soon()

    def _serve(self, queue: _Queue, end: float) -> float:
        """The first of them, and then as many as there is time for; returns the time."""
        readers = self._readers
        now = end
        while queue:
            descriptor = next(iter(queue))
            del queue[descriptor]
            reader = readers.get(descriptor)
            if reader is not None and reader() and descriptor in readers:
                queue[descriptor] = None
            now = clock.judged_now()
            if now >= end:
                break
        return now

    def _queue(self, descriptor: int) -> _Queue:
        return self._first if descriptor in self._preferred else self._others

    def _call_soon(self) -> None:
        if self._soon is None:
            self._soon = self._loop.call_soon(self._turn_unasked)

    def _turn_unasked(self) -> None:
        self._soon = None
        self._turn()
