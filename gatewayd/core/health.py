"""Counters and measurements of one cell, filled in by the core and by the links, shown by the status block."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from gatewayd.core.unserved import Unserved

HEARTBEAT_PERIOD = 0.1
"""Seconds between two counts of the heartbeat."""


@dataclass(slots=True)
class Health:
    """All counts are since the start of the gateway."""

    started: float = math.inf
    """Monotonic time of the first tick; infinity before it."""
    heartbeat: int = 0
    """Counts up every `HEARTBEAT_PERIOD` while the core works."""
    next_beat: float | None = None
    """Monotonic time of the next count; None before the first tick."""
    packages: int = 0
    skipped: int = 0
    """Packages the controller left out, seen from its timestamps."""
    late: int = 0
    frequency: float = 0.0
    """Packages per second, measured."""
    sessions: int = 0
    """Sessions with the controller; the first one is no reconnect."""
    read_back_mismatches: int = 0
    unadopted: int = 0
    """Inputs whose content in the robot is not known."""
    differing: int = 0
    """Inputs for which the robot holds something else than it was given."""
    lag: float = 0.0
    """Seconds by which the newest package is later than the quickest ones were."""
    adoption: float = 0.0
    """Seconds until adopted inputs without an owner fall back; 0: none will."""
    program: int | None = None
    """The controller's runtime_state; None where it is not known."""
    gaps: int = 0
    """Times the gateway stood still."""
    watchdog_fed: bool = False
    writes_accepted: int = 0
    writes_refused: int = 0
    lock_requests: int = 0
    """Requests for a lock, or for its release, by the number of a variable."""
    unserved: dict[Unserved, int] = field(default_factory=lambda: dict.fromkeys(Unserved, 0))
    """Requests that nothing here serves, by reason."""
    words: dict[str, int] = field(default_factory=dict)
    """Numbers of the status block that links report, by name (`LinkKind.status_fields`)."""
    tables: dict[str, dict[int, Sequence[int]]] = field(default_factory=dict)
    """Entries of tables of the status block that links report, by name of the table (`LinkKind.status_tables`)."""

    def beat(self, now: float) -> None:
        """Count the heartbeat, if it is time."""
        if self.next_beat is None:
            self.started = self.next_beat = now
        if now >= self.next_beat:
            self.heartbeat += 1
            self.next_beat = max(self.next_beat + HEARTBEAT_PERIOD, now)
