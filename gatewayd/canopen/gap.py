"""What a gap of our own does to a deadline of somebody else (`gatewayd.clock`): we were not there to hear it."""

from __future__ import annotations

__all__ = ["spared"]


def spared(due: float, time: float, since: float, now: float, *, again: bool) -> float:
    """The deadline after the process stood still from `since` to `now`.

    Who is supervised for `time` has all of it once more. In one silence that happens once; after further gaps
    (`again`) only their length does not count: else a process that stands still now and then would never miss anybody.
    """
    return due + (now - since) if again else now + time
