"""Pauses between attempts to connect. Pure; seconds of any one clock."""

from __future__ import annotations

_FIRST = 0.1


class Backoff:
    """None before the first attempt and after a connection that worked; then longer and longer ones, up to a limit."""

    __slots__ = ("_longest", "_pause", "until")

    def __init__(self, longest: float) -> None:
        self._longest = longest
        self._pause = 0.0
        self.until = float("-inf")
        """When the next attempt may be made."""

    def failed(self, now: float) -> None:
        """An attempt has failed, or the connection ended before anything was answered on it."""
        self._pause = min(max(_FIRST, 2 * self._pause), self._longest)
        self.until = now + self._pause

    def worked(self) -> None:
        """The connection was of use; it may be opened again at once."""
        self._pause = 0.0
        self.until = float("-inf")
