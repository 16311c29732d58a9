"""Lines for the robot program that belong to a mapping, in URScript."""

from __future__ import annotations

from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.plan import Plan

__all__ = ["watchdog_script"]

_MARGIN = 2
"""The program stops when so many feeds in a row are missing."""


def watchdog_script(plan: Plan) -> str:
    """The call that stops the program when the gateway no longer feeds the watchdog; empty without a watchdog.

    `rtde_set_watchdog` wants the least frequency of updates: half of the feeding, so that one late feed stops nothing.
    """
    watchdog = robot_of(plan).watchdog
    if watchdog is None:
        return ""
    required = [plan.cell.writers[writer].name for writer in watchdog.requires]
    alive = " and ".join(["the gateway", *required])
    return (
        f"# cell {plan.cell.name}: the program goes on only while {alive} live; at its beginning\n"
        f'rtde_set_watchdog("{watchdog.field}", {watchdog.frequency / _MARGIN:.6g}, "stop")\n'
    )
