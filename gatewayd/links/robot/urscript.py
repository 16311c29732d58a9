"""Lines for the robot program that belong to a mapping, in URScript."""

from __future__ import annotations

from typing import Final

from gatewayd.links.exports import Export, ExportError
from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.plan import Plan

_MARGIN = 2
"""The program stops when so many feeds in a row are missing."""


def watchdog_script(plan: Plan) -> str:
    """The call that stops the program when the gateway no longer feeds the watchdog; empty without a watchdog.

    `rtde_set_watchdog` wants the lowest frequency of updates: half of the feeding, so that one late feed stops nothing.
    """
    watchdog = robot_of(plan).watchdog
    if watchdog is None:
        return ""
    required = [plan.cell.writers[writer].name for writer in watchdog.requires]
    gone = " or ".join(["the gateway", *required])
    return (
        f"# cell {plan.cell.name}: put this line at the beginning of the program, which stops when {gone} is gone\n"
        f'rtde_set_watchdog("{watchdog.field}", {watchdog.frequency / _MARGIN:.6g}, "stop")\n'
    )


def _urscript(plan: Plan) -> str:
    text = watchdog_script(plan)
    if not text:
        raise ExportError(
            f"{plan.source}: the mapping declares no watchdog: add `watchdog:` to the section `robot`"
        )
    return text


EXPORTS: Final = (
    Export(
        "urscript",
        "The watchdog line of the robot program.",
        """Write the lines of a mapping FILE for the robot program: the watchdog that stops it when the gateway or a
        required writer is gone.""",
        "gatewayd export urscript my-cell.yaml",
        _urscript,
    ),
)
