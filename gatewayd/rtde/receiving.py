"""The receiving side of a connection: who reads its socket, the event loop or a thread that waits for packages.

A thread that does nothing but wait for the next package can read it itself: two system calls, where the loop's thread
would need a turn to read it, and then wake the waiting one. Both lead to the same protocol. As long as such a thread
reads, the loop does not; when it has not read for a while, because its program does something else, the loop goes on.
"""

from __future__ import annotations

import asyncio
import os
import select
from collections.abc import Callable

_SHORTEST, _LONGEST = 0.02, 0.1
"""Seconds after which the loop sees whether another thread still reads: looking costs as much as two packages."""
_ROOM = 30_000
"""Bytes that may come meanwhile. Twice as many may wait: a socket takes 64 kB without being tuned."""
_READ = 65536
"""Bytes of the buffer that every read goes into: a fresh one for each would cost more than its package."""


class PackageReceiver:
    """Reads one socket. `take` gets the number of bytes in `buffer`.

    Everything but `wait` is to be called as the callbacks of the loop are: by one thread at a time.
    """

    __slots__ = (
        "_attention",
        "_buffers",
        "_fd",
        "_interrupted",
        "_loop",
        "_poll",
        "_take",
        "_timer",
        "_transport",
        "_used",
        "buffer",
        "direct",
        "readable",
        "wait",
    )

    def __init__(self, take: Callable[[int], None], interrupted: Callable[[], None]) -> None:
        self.buffer = memoryview(bytearray(_READ))
        """What was read last."""
        self._buffers = (self.buffer,)
        self.direct = False
        """Whether another thread reads, by `read`."""
        self._take = take
        self._interrupted = interrupted
        self._poll = select.poll()
        self.wait = self._poll.poll
        """Wait for something to read, so many milliseconds at most. From any thread. See `readable`."""
        self.readable: list[tuple[int, int]] = []
        """What `wait` returns if there are bytes; else there are none, or something has happened to the connection."""
        self._fd = -1
        self._used = False
        self._attention = _SHORTEST
        self._transport: asyncio.Transport | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None

    def open(self, transport: asyncio.Transport) -> None:
        """Read this transport's socket from now on. Called in the loop."""
        self._loop = asyncio.get_running_loop()
        self._transport = transport
        self._fd = transport.get_extra_info("socket").fileno()
        self._poll.register(self._fd, select.POLLIN)
        self.readable = [(self._fd, select.POLLIN)]

    def expect(self, rate: float) -> None:
        """So many bytes come in a second: how long another thread may leave them in the socket follows from it."""
        self._attention = min(max(_SHORTEST, _ROOM / rate), _LONGEST)

    def close(self) -> None:
        """The socket is about to be closed: nobody reads any more."""
        self.direct = False
        self._transport = None
        if self._timer is not None:
            self._timer.cancel()

    def detach(self) -> None:
        """Have the loop read no more: the caller reads. Until the loop has heard of it both may."""
        if not self.direct and self._transport is not None and self._loop is not None:
            self.direct = self._used = True
            self._loop.call_soon_threadsafe(self._pause)

    def attach(self) -> None:
        """Have the loop read again."""
        if self.direct and self._loop is not None:
            self._loop.call_soon_threadsafe(self.resume)

    def read(self) -> bool:
        """Take in what is there, without waiting; False: the loop has to look after the connection.

        An exception that does not come from the protocol, as that of a signal handler, ends the connection: nobody
        knows how much of what was read has been taken in.
        """
        if not self.direct:
            return False
        self._used = True
        try:
            size = os.readv(self._fd, self._buffers)
            if size:
                self._take(size)
        except BaseException as error:
            if isinstance(error, OSError) and error.errno is not None:
                return isinstance(error, BlockingIOError)  # else the loop will meet it too
            self._interrupted()
            raise
        return size > 0

    # in the loop

    def resume(self) -> None:
        """Read in the loop from now on."""
        if self.direct and self._transport is not None:
            self.direct = False
            if self._timer is not None:
                self._timer.cancel()
            self._transport.resume_reading()

    def _pause(self) -> None:
        if self.direct and self._transport is not None and self._loop is not None:
            self._transport.pause_reading()
            self._timer = self._loop.call_later(self._attention, self._look_after)

    def _look_after(self) -> None:
        assert self._loop is not None
        if not self._used:
            self.resume()
        else:
            self._used = False
            self._timer = self._loop.call_later(self._attention, self._look_after)
