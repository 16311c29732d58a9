"""What is wrong with the robot's side of a cell, as errors of the node (EMCY FF10h to FF13h, bit 7 of 1001h).

| code | active while | bytes 4-5 of the EMCY |
|---|---|---|
| FF10h | the robot is not connected | |
| FF11h | it is connected and its values are stale | `robot_state` |
| FF12h | the robot holds something else than it was given | how many inputs |
| FF13h | the controller does not have, or gave to another client, what is mapped | how many variables |

None of them is a communication error: 1029h has nothing to do with it. An error that has gone is over when it has not
come back for `QUIET` seconds, or for the inhibit time of EMCY (1015h) if that is longer: what comes and goes is
reported once. Between connecting and the first package nothing is known that is new, and a robot that was never there
is missed after `FIRST_CONNECTION` seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from gatewayd.canopen.emergency import Emergency, ErrorCode
from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source

FIRST_CONNECTION: Final = 2.0
"""Seconds that a gateway that has just started has to find the robot."""

QUIET: Final = 1.0
"""Seconds without it after which an error is over."""

_ERRORS: Final = (
    ErrorCode.ROBOT_LOST,
    ErrorCode.ROBOT_STALE,
    ErrorCode.ROBOT_DIFFERS,
    ErrorCode.ROBOT_UNAVAILABLE,
)
_STALE: Final = (Source.SILENT, Source.FROZEN, Source.LATE)


class RobotErrors:
    """Looks at a cell and keeps its errors in `emergency`, while `running()` says that the node has booted."""

    def __init__(self, cell: Cell, emergency: Emergency, running: Callable[[], bool]) -> None:
        self._cell = cell
        self._emergency = emergency
        self._running = running
        self._gone: dict[ErrorCode, float] = {}
        """Active errors whose cause has gone, and when they are over."""
        self._missed_at = math.inf
        """When a robot that was never there counts as lost."""
        self._is_well = False
        """None of its errors was active when it was last looked at: this is asked for with every change of the cell."""

    def tick(self, now: float) -> None:
        """Judge the cell as it is now."""
        if not self._running():
            return
        state, differing = self._cell.freshness.state, self._cell.health.differing
        missing = self._cell.image.available.count(False)
        if self._is_well and state is Source.FRESH and not differing and not missing:
            return
        if self._missed_at == math.inf:
            self._missed_at = now + FIRST_CONNECTION
        if state is not Source.WAITING:
            self._judge(ErrorCode.ROBOT_LOST, state is Source.LOST and self._is_missed(now), 0, now)
            self._judge(ErrorCode.ROBOT_STALE, state in _STALE, state, now)
        self._judge(ErrorCode.ROBOT_DIFFERS, differing > 0, differing, now)
        self._judge(ErrorCode.ROBOT_UNAVAILABLE, missing > 0, missing, now)
        self._is_well = not any(map(self._emergency.active, _ERRORS))

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do whatever happens to the cell."""
        over = min(self._gone.values(), default=math.inf)
        return over if self._is_missed(now) else min(over, self._missed_at)

    def _is_missed(self, now: float) -> bool:
        """Whether a robot that is not connected counts as lost."""
        known = self._cell.health.sessions > 0 or self._emergency.active(ErrorCode.ROBOT_LOST)
        return known or now >= self._missed_at

    def _judge(self, code: ErrorCode, wrong: bool, detail: int, now: float) -> None:
        if wrong:
            self._gone.pop(code, None)
            self._emergency.raise_error(code, now, min(detail, 0xFFFF).to_bytes(2, "little"))
        elif self._emergency.active(code):
            over = self._gone.setdefault(code, now + max(QUIET, self._emergency.inhibit))
            if now >= over:
                del self._gone[code]
                self._emergency.clear(code, now)
        else:
            self._gone.pop(code, None)
