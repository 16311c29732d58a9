"""A cell, its link and a simulated controller, joined by a real connection."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from dataclasses import dataclass, replace

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.events import EventKind
from gatewayd.core.requester import Requester
from gatewayd.links.robot.plan import robot_of
from gatewayd.links.robot.runtime import RobotLink
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.rtde.fields import Field, SoftwareVersion
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.program import DEMO, parse
from gatewayd.simulator.server import SimulatedController

PLC, HMI = 0, 1

HEAD = """\
gatewayd: 1
cell: link
robot: {{host: 127.0.0.1, port: {port}, stale_after: 5s, adopt_for: none{options}}}
writers: {{plc: {{modbus: 127.0.0.2}}, hmi: {{modbus: 127.0.0.3}}}}
modbus: {{listen: '127.0.0.1:1502'}}
variables:
"""


class Defect(Exception):
    """What a test has a listener raise."""


@dataclass
class Rig:
    """All three, running."""

    robot: SimulatedController
    cell: Cell
    link: RobotLink
    task: asyncio.Task[None]

    def write(self, *changes: tuple[int, bool | int | float], writer: int = PLC) -> None:
        """Apply a write request that must be accepted."""
        refusal = self.cell.write(Requester(writer), [Change(*one) for one in changes], time.monotonic())
        assert refusal is None, refusal

    def get(self, field: str) -> object:
        """What the controller holds."""
        return self.robot.get(field)

    def events(self, kind: EventKind) -> list[str]:
        """Details of the events of a kind."""
        return [event.detail for event in self.cell.events if event.kind is kind]


Rigged = Callable[..., AbstractAsyncContextManager[Rig]]


def plan_for(port: int, variables: str, options: str = "") -> Plan:
    """The plan of a mapping that has no errors."""
    loaded = load((HEAD.format(port=port, options=options) + variables).encode(), "link.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


@asynccontextmanager
async def rigged(
    variables: str,
    options: str = "",
    prepare: Callable[[SimulatedController], None] | None = None,
    version: SoftwareVersion | None = None,
    definition: Callable[[CellDefinition], CellDefinition] = lambda one: one,
    *,
    fields: Sequence[Field] = (),
) -> AsyncIterator[Rig]:
    """A controller that echoes its registers, a cell for the variables given, and their link, running."""
    async with SimulatedController(Controller(version=version, program=parse(DEMO), fields=fields)) as robot:
        if prepare is not None:
            prepare(robot)
        plan = plan_for(robot.port, variables, options)
        async with linked(robot, replace(plan, cell=definition(plan.cell))) as rig:
            yield rig


@asynccontextmanager
async def linked(robot: SimulatedController, plan: Plan) -> AsyncIterator[Rig]:
    """A cell and its link to that controller."""
    cell = Cell(plan.cell)
    link = RobotLink(robot_of(plan), cell)
    task = asyncio.create_task(link.run())
    try:
        yield Rig(robot, cell, link, task)
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError, Defect):
            await task
