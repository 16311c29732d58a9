"""Mappings with a dashboard server, and a cell with both links at a simulated robot."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from gatewayd.links.robot.dashboard.link import DashboardLink
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.plan import robot_of
from gatewayd.links.robot.runtime import RobotLink
from gatewayd.loop import clock
from gatewayd.mapping.loader import Loaded, load
from gatewayd.mapping.plan import Plan
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard import PolyScope
from gatewayd.simulator.dashboard_server import DashboardServer
from gatewayd.simulator.server import SimulatedController

HEAD = """\
gatewayd: 1
cell: press
robot: {{host: 127.0.0.1, port: {rtde}, adopt_for: none, stale_after: 5s{dashboard}}}
modbus: {{listen: '127.0.0.1:1502'}}
writers: {{plc: {{modbus: 127.0.0.2, timeout: 1s}}, hmi: {{modbus: 127.0.0.3, timeout: 1s}}}}
variables:
"""
SECTION = ", dashboard: {port: %d, poll: 100ms, programs: {1: pick.urp, 2: none.urp}}"
VARIABLES = """\
  start:   {dashboard: play, modbus: 0.0, owner: plc}
  halt:    {dashboard: stop, modbus: 1.0, owner: plc}
  program: {dashboard: load, modbus: 2, owner: plc}
  bit:     {robot: input_bit_register_0, modbus: 3.0, owner: plc}
  mode:    {dashboard: robot_mode, modbus: 100}
  state:   {dashboard: program_state, modbus: 102}
  loaded:  {dashboard: loaded, modbus: 104}
  remote:  {dashboard: remote_control, modbus: 106.0}
  result:  {dashboard: result, modbus: 107}
  up:      {dashboard: connected, modbus: 109.0}
  speed:   {robot: target_speed_fraction, modbus: 110}
"""
START, HALT, PROGRAM, BIT, MODE, STATE, LOADED, REMOTE, RESULT, UP, SPEED = range(11)
PLC = Requester(0, connection=1)


def loaded(variables: str = VARIABLES, dashboard: str = SECTION % 29999, rtde: int = 1) -> Loaded:
    """What is read of a mapping with these variables."""
    return load((HEAD.format(rtde=rtde, dashboard=dashboard) + variables).encode(), "press.yaml")


def planned(variables: str = VARIABLES, dashboard: str = SECTION % 29999, rtde: int = 1) -> Plan:
    """The plan of a mapping that has no errors."""
    plan = loaded(variables, dashboard, rtde).plan
    assert plan is not None
    return plan


@dataclass
class Rig:
    """A cell and its links, running."""

    robot: SimulatedController
    server: DashboardServer
    cell: Cell
    link: DashboardLink

    def write(self, variable: int, value: Value) -> None:
        """Write a command as the PLC; it must be accepted."""
        refusal = self.cell.write(PLC, [Change(variable, value)], clock.now())
        assert refusal is None, refusal

    def give(self, variable: int, value: Value = 1) -> None:
        """Give a command as it has to be."""
        self.write(variable, 0)
        self.write(variable, value)

    def value(self, variable: int) -> Value:
        """What the image has."""
        return self.cell.image.values[variable]

    def good(self, variable: int) -> bool:
        """Whether it can be trusted."""
        return self.cell.image.quality[variable] is Quality.GOOD

    def details(self, kind: EventKind) -> list[str]:
        """Details of the events of a kind."""
        return [event.detail for event in self.cell.events if event.kind is kind]

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until it is so."""
        async with asyncio.timeout(10):
            while not condition():  # noqa: ASYNC110 - it is about four parties
                await asyncio.sleep(0.005)

    async def result(self, number: int) -> None:
        """Wait for this result."""
        await self.until(lambda: self.value(RESULT) == number)


@asynccontextmanager
async def rigged(variables: str = VARIABLES) -> AsyncIterator[Rig]:
    """Everything connected and fresh."""
    robot = SimulatedController(Controller())
    server = robot.dashboard = DashboardServer(PolyScope(robot.controller))
    async with robot:
        plan = planned(variables, SECTION % server.port, robot.port)
        cell = Cell(plan.cell)
        link = DashboardLink(plan.the(DashboardPlan), cell)
        tasks = [asyncio.create_task(each.run()) for each in (RobotLink(robot_of(plan), cell), link)]
        rig = Rig(robot, server, cell, link)
        try:
            await rig.until(lambda: cell.accepts_writes and cell.freshness.state is Source.FRESH)
            await rig.until(lambda: rig.value(UP) is True and rig.good(MODE))
            yield rig
        finally:
            for task in tasks:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task
