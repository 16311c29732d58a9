"""What may have waited in a socket while the process stood still. Pure.

The kernel takes what a broker sends whether or not the process runs, and nobody knows when its bytes came. So after a
gap all counts as having waited until a read finds less than it could take, and so does what comes shortly after: that
may have been on the way, in a network card or in the broker, which had no room for it.
"""

from __future__ import annotations

from typing import Final

SETTLING: Final = 0.05
"""Seconds after a gap in which what comes in counts as having waited."""
FULL_READ: Final = 16_384
"""Bytes of a read that may have left something in the socket: a record of TLS has as many."""


class WaitedMessages:
    """One connection after a gap."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._until = 0.0
        self._undrained = False

    def gap(self, since: float, until: float) -> None:
        """The process stood still. What an earlier gap left waits for even longer."""
        if self._since is None or not self._undrained:
            self._since = since
        self._until, self._undrained = until, True

    def read(self, size: int) -> None:
        """A read has brought `size` bytes; they belong to what waited themselves."""
        if self._undrained and size < FULL_READ:
            self._undrained = False

    def seconds(self, now: float) -> float:
        """How long what is served now may have waited; 0: it came when it was read."""
        if self._since is None:
            return 0.0
        if self._undrained or now <= self._until + SETTLING:
            return now - self._since
        self._since = None
        return 0.0
