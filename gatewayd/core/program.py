"""Which states of the robot program count as running, for variables that mean something only while it runs."""

from __future__ import annotations

STATES: dict[int, tuple[str, bool]] = {
    0: ("stopping", False),
    1: ("stopped", False),
    2: ("playing", True),
    3: ("pausing", True),
    4: ("paused", True),
    5: ("resuming", True),
    6: ("retracting", False),
}
"""RTDE's `runtime_state`: its name, and whether the program runs.

A program that pauses still owns what it wrote and goes on with it. One that stops writes nothing any more, so what its
registers hold is what it left behind; a robot that retracts is not on the program's path.
"""


NUMBERS: dict[str, int] = {name: state for state, (name, _running) in STATES.items()}
"""The `runtime_state` of each name."""


def is_running(state: int | None) -> bool:
    """Whether what the program wrote is still meant.

    A state that is not in the table, or that the controller does not report (None), is not running: who declares
    `valid: running` asks that a value be good only if that is known.
    """
    return state is not None and state in STATES and STATES[state][1]
