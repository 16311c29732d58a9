"""What is known of the other gateway: when it was heard, and what it said then. Pure: time is a parameter."""

from __future__ import annotations

import math

from gatewayd.links.standby.heartbeat import Heartbeat
from gatewayd.links.standby.roles import StandbyRole

PERIOD = 0.1
"""Seconds between two heartbeats."""
GONE_AFTER = 0.5
"""Seconds without one after which the other gateway counts as gone: four may be lost in a row."""


class Sight:
    """The other gateway, as it is seen from here. `number` is ours, `fingerprint` that of our mapping."""

    def __init__(self, number: int, fingerprint: int) -> None:
        self.number = number
        self.fingerprint = fingerprint
        self.strange = 0
        """Datagrams that were none of ours, or did not repeat our number."""
        self._named = 0
        self._heard: Heartbeat | None = None
        self._heard_at = -math.inf
        self._refused = False

    def heard(self, heartbeat: Heartbeat | None, now: float) -> None:
        """A datagram came, or something that is none."""
        if heartbeat is None or heartbeat.number == self.number:
            self.strange += 1
            return
        self._named = heartbeat.number
        if heartbeat.echo != self.number:
            # The first datagram after a start of either cannot know our number.
            self.strange += heartbeat.echo != 0
            return
        self._heard, self._heard_at, self._refused = heartbeat, now, False

    @property
    def echo(self) -> int:
        """The number to be repeated to the other gateway; 0: none was heard.

        The last one that was believed, whatever was named since: else a forged datagram would make the other gateway
        believe none of ours. One that has started anew knows nobody yet and repeats our number, no matter who names it,
        so that its new number is believed next.
        """
        return self._heard.number if self._heard is not None else self._named

    def refused(self) -> None:
        """Its machine answered that nobody listens there."""
        self._refused = True

    def age(self, now: float) -> float:
        """Seconds since it was heard; infinity: never."""
        return now - self._heard_at

    def alive(self, now: float) -> bool:
        """Whether it was heard just now."""
        return not self._refused and self.age(now) < GONE_AFTER

    @property
    def last(self) -> Heartbeat | None:
        """What it said last, be it alive or not."""
        return self._heard

    @property
    def differs(self) -> bool:
        """Whether its mapping, as it said last, means something else than ours."""
        return self._heard is not None and self._heard.fingerprint != self.fingerprint

    def role(self, now: float) -> StandbyRole | None:
        """Its role; None: it is gone."""
        return self._heard.role if self._heard is not None and self.alive(now) else None

    def connected(self, now: float) -> bool:
        """Whether it is there, with a session with the robot."""
        return self._heard is not None and self.alive(now) and self._heard.connected

    def ready(self, now: float) -> bool:
        """Whether it would take over at once."""
        return self._heard is not None and self.alive(now) and self._heard.ready and not self.differs
