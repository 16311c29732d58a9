"""A gap of our own (`gatewayd.loop.clock`): deadlines of others whom we could not hear, and frames that waited."""

from __future__ import annotations

import math
from typing import Final

from gatewayd.canopen.dictionary import Abort, AbortCode

LATE_PARAMETER: Final = 0.5
"""Seconds that a download of a parameter may have waited while the process stood still."""

_FIRST_OF_CELL: Final = 0x2000
"""Where the objects of the communication end."""


def spared(due: float, time: float, since: float, now: float, *, again: bool) -> float:
    """The deadline after the process stood still from `since` to `now`.

    Who is supervised for `time` has all of it once more. In one silence that happens once; after further gaps
    (`again`) only their length does not count: else a process that stands still now and then would never miss anybody.
    """
    return due + (now - since) if again else now + time


class Waiting:
    """How long the frames that are served now may have waited."""

    __slots__ = ("_since", "seconds")

    def __init__(self) -> None:
        self.seconds = 0.0
        self._since = math.inf

    def gap(self, since: float, now: float) -> None:
        """The process stood still: until `caught_up`, what is served may have waited so long."""
        self._since = min(self._since, since)
        self.seconds = now - self._since

    def caught_up(self) -> None:
        """What is served from now on came in time."""
        self._since, self.seconds = math.inf, 0.0

    def permit(self, index: int) -> None:
        """A parameter is not set by a client that has given up; what variables and locks wait for the cell judges."""
        if index < _FIRST_OF_CELL and self.seconds > LATE_PARAMETER:
            raise Abort(AbortCode.DEVICE_STATE)

    def resume(self, former: Waiting) -> None:
        """Go on where `former` stands."""
        self._since, self.seconds = former._since, former.seconds
