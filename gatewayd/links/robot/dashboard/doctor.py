"""What `gatewayd doctor` looks at of a dashboard server: whether it answers, and whether commands would be obeyed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress

from gatewayd.core.definition import CellDefinition
from gatewayd.dashboard.client import CONNECT_WITHIN, GREETED_WITHIN, DashboardClient
from gatewayd.dashboard.replies import DashboardReply
from gatewayd.dashboard.requests import DashboardRequest
from gatewayd.dashboard.state import RobotState
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address

CHECK = "dashboard"
WITHIN = CONNECT_WITHIN + GREETED_WITHIN
"""Seconds for the connection and the first round of questions."""


class DashboardExamination(Examination):
    """Asks one round of questions, and gives no command."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, DashboardPlan)
        met = await _meet(plan)
        for observation in observations(plan, met):
            yield observation


def observations(plan: DashboardPlan, met: RobotState | str) -> Iterator[Observation]:
    """What a round of answers means for the mapping, or why there was none."""
    where = address(plan.host, plan.port)
    if isinstance(met, str):
        yield Observation(
            CHECK,
            Outcome.PROBLEM,
            f"{where}: {met}",
            "no command reaches the robot, and its states are stale",
            "switch the dashboard server on (Settings > Security > Services), and check address and firewall",
        )
        return
    yield Observation.well(CHECK, f"{where} answers: robot mode {met.robot_mode}, safety {met.safety}")
    if met.remote is False:
        yield Observation(
            CHECK,
            Outcome.WARNING,
            "the robot is in local control",
            "it refuses every command from outside until somebody at the pendant allows it",
            "switch the robot to remote control at the pendant, where it is to be started from the PLC",
        )
    if plan.programs:
        yield _loaded(plan, met.loaded)


def _loaded(plan: DashboardPlan, path: str | None) -> Observation:
    if not path:
        return Observation(CHECK, Outcome.NOTE, "no program is loaded")
    number = plan.number_of(path)
    which = f"number {number}" if number else "none of `programs`"
    return Observation(CHECK, Outcome.OK if number else Outcome.NOTE, f"{path} is loaded: {which}")


class _Visit:
    """A handler that waits for the first round, or for the first failure."""

    def __init__(self) -> None:
        self.met: asyncio.Future[RobotState | str] = asyncio.get_running_loop().create_future()

    def connected(self) -> None:
        pass

    def state_read(self, state: RobotState) -> None:
        self._end(state)

    def answered(self, request: DashboardRequest, reply: DashboardReply) -> None:
        pass

    def lost(self, reason: str, *, was_connected: bool) -> None:
        self._end(reason)

    def _end(self, met: RobotState | str) -> None:
        if not self.met.done():
            self.met.set_result(met)


async def _meet(plan: DashboardPlan) -> RobotState | str:
    visit = _Visit()
    work = asyncio.create_task(DashboardClient(plan.host, plan.port, plan.period, visit).run())
    try:
        async with asyncio.timeout(WITHIN):
            return await visit.met
    except TimeoutError:
        return f"no answers within {WITHIN:g} s"
    finally:
        work.cancel()
        with suppress(asyncio.CancelledError):
            await work


EXAMINATION = DashboardExamination()
"""Looks at what this kind of link needs."""
