"""The plan of a session with the controller in words."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.links.contract import Description, Names
from gatewayd.links.robot.plan import RobotPlan, WatchdogPlan
from gatewayd.report.format import address, exact, seconds

__all__ = ["description"]


def description(plan: RobotPlan, cell: CellDefinition) -> Description:
    """Settings and address. Places have none: what a variable is in the robot, the definition of the cell says."""
    return Description(
        settings={
            "host": plan.host,
            "port": str(plan.port),
            "frequency": f"{exact(plan.frequency)} Hz" if plan.frequency else "the controller's own",
            "stale_after": seconds(cell.stale_after),
            "on_connect": "fallback" if cell.clear_on_connect else "adopt",
            "adopt_for": seconds(cell.adopt_for) or "none",
            "verify": str(plan.verify).lower(),
            "watchdog": _watchdog(plan.watchdog, cell),
            "subscribed": Names(" ".join(sorted(plan.outputs))),
            "claimed": Names(" ".join(sorted(plan.inputs))),
        },
        address=address(plan.host, plan.port),
        fields={"address": address(plan.host, plan.port)},
    )


def _watchdog(watchdog: WatchdogPlan | None, cell: CellDefinition) -> str:
    if watchdog is None:
        return ""
    required = "".join(f", requires {cell.writers[writer].name}" for writer in watchdog.requires)
    return f"{watchdog.field} at {exact(watchdog.frequency)} Hz{required}"
