"""One robot cell with its links: made from a plan, and carried over to another plan by a reload."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.health import CAN_BUS
from gatewayd.core.succession import Succession, succeed
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.robot.plan import robot_of
from gatewayd.links.robot.runtime import RobotLink
from gatewayd.logs.events import EventLog
from gatewayd.mapping.plan import Plan

if TYPE_CHECKING:
    from gatewayd.links.canopen_node.runtime import CanLink

__all__ = ["Link", "Station"]

_CARRYING = ("passive", "warning", "active")
"""States of a CAN bus in which a master can reach us."""


class Link(Protocol):
    """One connection to the outside."""

    async def run(self) -> None:
        """Work until cancelled."""

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`; called before anything that waited is served."""

    async def close(self) -> None:
        """Send what is still due; `run` is cancelled afterwards."""


@dataclass(eq=False)
class Station:
    """One cell with its links. A reload puts other ones in their place."""

    plan: Plan
    state: Path
    """Directory of what the cell keeps across restarts."""
    cell: Cell = field(init=False)
    robot: RobotLink = field(init=False)
    can: CanLink | None = field(init=False)

    def __post_init__(self) -> None:
        self._furnish(Cell(self.plan.cell))
        self.robot = RobotLink(robot_of(self.plan), self.cell)
        self.can = self._can_link()

    @property
    def links(self) -> tuple[Link, ...]:
        """What is to be run."""
        return (self.robot,) if self.can is None else (self.robot, self.can)

    @property
    def is_on_bus(self) -> bool:
        """Whether the cell has a CANopen node and its bus carries frames."""
        return self.can is not None and CAN_BUS[self.cell.health.can_bus] in _CARRYING

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: the cell judges the time first, then its links."""
        self.cell.gap(since, now)
        for link in self.links:
            link.gap(since, now)

    def succeed(self, plan: Plan, now: float) -> tuple[str, ...]:
        """Go on with another plan, by the same links if that can be; names of inputs left as they were.

        A CANopen node whose objects or PDOs change is made anew, and boots.
        """
        can, canopen = self.can, canopen_of(plan)
        stays = can is not None and canopen is not None and can.fits(canopen, plan.cell)
        if can is not None and not stays:
            can.node.lose_writers("the new mapping needs another node", now)
        succession = self._hand_over(plan.cell, now)
        self.plan = plan
        self._furnish(succession.cell)
        if not self.robot.rebind(robot_of(plan), self.cell, now):
            self.cell.robot_lost("the new mapping needs another session", now)
            self.robot = RobotLink(robot_of(plan), self.cell, self.robot)
        if can is not None and canopen is not None and stays:
            can.rebind(canopen, self.cell, now)
        else:
            self.can = self._can_link()
        return succession.stranded

    def retire(self, now: float) -> tuple[str, ...]:
        """Release everything for good; names of inputs left as they were."""
        return self._hand_over(replace(self.plan.cell, variables=(), locks=(), writers=()), now).stranded

    def _hand_over(self, definition: CellDefinition, now: float) -> Succession:
        """End the cell: the robot is given what falls due by that, and nobody listens to it any more."""
        former = self.cell
        succession = succeed(former, definition, now)
        self.robot.flush(now)
        former.listeners.clear()
        former.events.listeners.clear()
        former.write_listeners.clear()
        return succession

    def _furnish(self, cell: Cell) -> None:
        self.cell = cell
        cell.events.listeners.append(EventLog(cell))

    def _can_link(self) -> CanLink | None:
        plan = canopen_of(self.plan)
        if plan is None:
            return None
        # Most cells have no CAN, and start sooner without it.
        from gatewayd.links.canopen_node.runtime import CanLink  # noqa: PLC0415
        from gatewayd.links.canopen_node.storage import JsonStore  # noqa: PLC0415

        return CanLink(plan, self.cell, JsonStore(self.state / f"{self.plan.cell.name}.canopen.json"))
