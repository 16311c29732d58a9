"""How much of a line's time probes of lost units may take. Pure; seconds of any one clock."""

from __future__ import annotations

DEFAULT_SHARE = 0.05


class ProbeBudget:
    """One for a line. A probe that fails is paid for with a pause before the next, whichever unit that is for.

    So all lost units together cost those that answer less than `share` of the time, and each is probed in its turn.
    Where nobody answers there is nobody to protect: the line does not ask then.
    """

    __slots__ = ("_factor", "free_at")

    def __init__(self, share: float = DEFAULT_SHARE) -> None:
        self._factor = 1 / share - 1
        self.free_at = float("-inf")
        """When the next probe may go out."""

    def spend(self, seconds: float, now: float) -> None:
        """A probe has failed that took so long."""
        self.free_at = now + seconds * self._factor
