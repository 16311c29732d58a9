"""What may have waited in a socket while the gateway stood still.

The kernel takes what peers send, and their connections, whether or not the process runs. Of one read nobody knows
when its bytes came; so after a gap everything counts as waiting until the socket was read empty, and so does what
comes within `SETTLING` of it: that may have been in the queues of a network card or a hypervisor.

Not seen: what a peer's system sends again, because it could not deliver it to a machine that stood still.
"""

from __future__ import annotations

SETTLING = 0.01
"""Seconds after a gap in which what comes in counts as having waited."""


class WaitedInput:
    """One connection after a gap: how long what is read from it may have waited."""

    __slots__ = ("_settled_at", "since", "undrained")

    def __init__(
        self, since: float, until: float, *, unread: bool, former: WaitedInput | None = None
    ) -> None:
        """`unread`: there is something in the socket, or a part of a request was read already.

        `former` is what an earlier gap left.
        """
        self.since: float = since
        self.undrained: bool = unread
        self._settled_at: float = until + SETTLING
        if former is not None and former.undrained:
            self.since, self.undrained = former.since, True

    def seconds(self, now: float) -> float:
        """How long what is read now may have waited; 0: all that waited was read before."""
        return now - self.since if self.undrained or now <= self._settled_at else 0.0

    def drained(self) -> None:
        """A read found less than it asked for."""
        self.undrained = False
