"""The compiled robot side of a mapping: how to reach the controller and what to ask of it, immutable."""

from __future__ import annotations

from dataclasses import dataclass, field

from gatewayd.mapping.plan import NO_MEANING, LinkPlan, Plan

WATCHDOG_MARGIN = 2
"""Feeds that `rtde_set_watchdog` of the generated program waits for: one that comes late stops nothing."""


@dataclass(frozen=True, slots=True)
class WatchdogPlan:
    """The input register that is fed while gateway and required writers are healthy (URScript `rtde_set_watchdog`)."""

    field: str
    frequency: float
    """Feeds per second."""
    requires: tuple[int, ...]
    """Writers that must be alive for the feeding to go on."""


@dataclass(frozen=True, slots=True)
class RobotPlan(LinkPlan):
    """How to reach the controller and what to ask of it."""

    kind = "robot"

    host: str
    port: int
    frequency: float
    """Output packages per second asked for; 0: the controller's own rate."""
    outputs: tuple[str, ...]
    """Fields to subscribe, in the order of their first variable; without `timestamp` and read-backs."""
    inputs: tuple[str, ...]
    """Fields to claim, in the order of their first variable."""
    verify: bool
    """Compare what was written with what the controller reads back."""
    watchdog: WatchdogPlan | None = None
    types: tuple[tuple[str, str], ...] = ()
    """Fields whose type the file declares, with the type's word."""
    series: str | None = field(default=None, metadata=NO_MEANING)
    """What the file says of the controller, for `check`, and to compare it with the controller's answer."""
    version: str | None = field(default=None, metadata=NO_MEANING)
    """The same of its software."""


def robot_of(plan: Plan) -> RobotPlan:
    """The controller of a cell."""
    return plan.the(RobotPlan)
