"""The dashboard link: commands of a cell to the controller's dashboard server, and the robot's states from it.

Whether a command acts, the core says (`core.commands`); here it is sent at once, or refused at once with the reason:
nothing waits for a connection, for remote control, or for the command before it. The states `result` and `connected`
are the gateway's own and always good; the others are stale without an answer for `STALE_PERIODS` rounds.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections import Counter

from gatewayd.core.cell import Cell
from gatewayd.core.commands import Attempt
from gatewayd.core.definition import Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.dashboard.client import DashboardClient
from gatewayd.dashboard.replies import CommandOutcome, DashboardReply
from gatewayd.dashboard.requests import DashboardRequest, Verb
from gatewayd.dashboard.state import RobotState
from gatewayd.links.contract import Level, Link, LinkHealth, Passage, Tap
from gatewayd.links.robot.dashboard.declaration import RESULT_WORD, STATE_WORD
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.dashboard.reports import RefusalReports
from gatewayd.links.robot.dashboard.results import BY_OBSTACLE, BY_OUTCOME, CommandResult
from gatewayd.links.robot.dashboard.state_values import values_of
from gatewayd.links.robot.dashboard.variables import OWN, VERBS, VIA, name_of
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address
from gatewayd.report.printable import printable

STALE_PERIODS = 5
"""Rounds of questions without an answer after which states are stale; never less than `MIN_STALE_AFTER` seconds."""
MIN_STALE_AFTER = 2.0
LOSS_INTERVAL = 60.0
"""Seconds after which a connection that still fails for the same reason is logged again."""
_LOOK = 0.25

log = logging.getLogger("gatewayd.dashboard")


class DashboardLink(Link):
    """Keeps a cell and its controller's dashboard server in touch while `run` runs."""

    title = "dashboard link"
    plan: DashboardPlan

    def __init__(self, plan: DashboardPlan, cell: Cell) -> None:
        self.plan = plan
        self.client = DashboardClient(plan.host, plan.port, plan.period, self)
        self._result = CommandResult.NONE
        self._answer: str | None = None
        self._sent = 0
        self._refused: Counter[CommandResult] = Counter()
        self._state = RobotState()
        self._told_at = -math.inf
        self._trouble = ""
        self._logged: tuple[str, float] = ("", -math.inf)
        self._under_way: Attempt | None = None
        self._reports = RefusalReports()
        self._bind(cell)
        for index in self._commands:
            # Nobody was told that they are there.
            cell.image.set_available(index, available=False)
        self._show_own(clock.now())

    def health(self) -> LinkHealth:
        """The connection and the last command."""
        where = address(self.plan.host, self.plan.port)
        is_up = self.client.is_connected
        figures: dict[str, object] = {
            "address": where,
            "state": self._words(),
            "trouble": "" if is_up else self._trouble,
            "up": int(is_up),
            "connections": self.client.connections,
            "commands": self._sent,
            "refused": {result.name.lower(): count for result, count in sorted(self._refused.items())},
            "result": self._result.words,
            "answer": self._answer,
            "loaded": self._state.loaded if is_up else None,
        }
        name = f"Dashboard {where}"
        if is_up:
            return LinkHealth(name, Level.GOOD, self._words(), "", (), figures)
        problems = (f"dashboard server {where}: {self._trouble}",) if self._trouble else ()
        return LinkHealth(name, Level.BAD, "not connected", self._trouble, problems, figures)

    @property
    def progress(self) -> int:
        """Moves several times a second while `run` works, whatever the controller does."""
        return self.client.progress

    async def run(self) -> None:
        """Stay connected until cancelled."""
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self.client.run())
                group.create_task(self._watch())
        finally:
            self._cell.carried.end(VIA, "the dashboard link has ended", clock.now())

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on by the connection that is there. What was written before does not count any more."""
        assert isinstance(plan, DashboardPlan)
        self.plan = plan
        self._under_way = None
        self._reports.forget()
        self._bind(cell)
        if self.client.is_connected:
            cell.carried.begin(VIA, now)
            self._show(now)
        else:
            cell.carried.end(VIA, self._trouble, now)
        self._show_own(now)

    def trace(self, tap: Tap | None) -> None:
        """What is said to the dashboard server and by it."""
        if tap is None:
            self.client.trace(None)
            return
        peer = address(self.plan.host, self.plan.port)

        def passed(data: bytes, outgoing: bool, own: tuple[str, int] | None) -> None:
            tap(Passage(clock.now(), data, outgoing, peer, address(own[0], own[1]) if own else ""))

        self.client.trace(passed)

    # -- called by the cell ------------------------------------------------------------------------------------------

    def _attempted(self, attempt: Attempt) -> None:
        """A command was written."""
        name = self._commands.get(attempt.variable)
        if name is None:
            return
        request = self._request(name, attempt.value)
        obstacle = self._obstacle(attempt, request)
        if obstacle is not None:
            self._refuse(attempt, obstacle)
            return
        assert request is not None
        if not self.client.give(request):
            is_up = self.client.is_connected
            self._refuse(attempt, CommandResult.BUSY if is_up else CommandResult.NOT_CONNECTED)
            return
        self._under_way = attempt
        self._record(EventKind.COMMANDED, attempt, request.line)
        self._conclude(CommandResult.UNDER_WAY, None, attempt.time)

    def _request(self, name: str, value: Value) -> DashboardRequest | None:
        verb = VERBS[name]
        if verb is not Verb.LOAD:
            return DashboardRequest(verb)
        file = self.plan.file_of(int(value))
        return None if file is None else DashboardRequest(verb, file)

    def _obstacle(self, attempt: Attempt, request: DashboardRequest | None) -> CommandResult | None:
        """What is known to stand in the way, before the robot is asked."""
        if attempt.obstacle is not None:
            return BY_OBSTACLE[attempt.obstacle]
        if request is None:
            return CommandResult.NO_SUCH_NUMBER
        if self._cell.freshness.state is not Source.FRESH:
            return CommandResult.ROBOT_AWAY
        if not self.client.is_connected:
            return CommandResult.NOT_CONNECTED
        if self._state.remote is False:
            return CommandResult.LOCAL_CONTROL
        if request.command is Verb.PLAY and self._state.loaded == "":
            return CommandResult.NO_PROGRAM
        return None

    # -- called by the client ----------------------------------------------------------------------------------------

    def connected(self) -> None:
        """Commands can be given, once everybody has let go of them."""
        now = clock.judged_now()
        self._trouble, self._logged = "", ("", -math.inf)
        self._cell.carried.begin(VIA, now)
        self._show_own(now)

    def state_read(self, state: RobotState) -> None:
        """A round of questions was answered."""
        now = clock.judged_now()
        self._state, self._told_at = state, now
        self._show(now)
        self._show_words()

    def answered(self, request: DashboardRequest, reply: DashboardReply) -> None:
        """What became of the command that was under way."""
        now = clock.judged_now()
        attempt, self._under_way = self._under_way, None
        result = BY_OUTCOME[reply.outcome]
        answer = printable(reply.text) or None
        if reply.outcome is not CommandOutcome.NOT_SENT:
            self._sent += 1
        if attempt is None:
            # It was given by the former mapping: the result is that of the robot all the same.
            self._conclude(result, answer, now)
        elif result.is_refusal:
            self._refuse(attempt, result, answer, now)
        else:
            self._record(EventKind.COMMAND_DONE, attempt, answer or request.line, now)
            self._conclude(result, answer, now)

    def lost(self, reason: str, *, was_connected: bool) -> None:
        """There is no connection."""
        now = clock.judged_now()
        self._trouble = reason
        self._state, self._told_at = RobotState(), -math.inf
        if was_connected:
            self._cell.carried.end(VIA, f"dashboard server: {reason}", now)
        self._cell.carried.unreported(self._others())
        self._show_own(now)
        reported, at = self._logged
        if reason != reported or now - at >= LOSS_INTERVAL:
            self._logged = (reason, now)
            where = address(self.plan.host, self.plan.port)
            log.warning(
                "no dashboard server",
                extra=fields(cell=self._cell.definition.name, address=where, reason=reason),
            )

    # -- inside ------------------------------------------------------------------------------------------------------

    def _bind(self, cell: Cell) -> None:
        self._cell = cell
        variables = cell.definition.variables
        self._commands = {index: name_of(variables[index].field) for index in cell.carried.commands(VIA)}
        self._states: dict[str, list[int]] = {}
        for index in cell.carried.outputs(VIA):
            self._states.setdefault(name_of(variables[index].field), []).append(index)
        cell.commands.listeners.append(self._attempted)

    async def _watch(self) -> None:
        """States are stale while the server does not answer, say because it is loading a program."""
        after = max(STALE_PERIODS * self.plan.period, MIN_STALE_AFTER)
        while True:
            await asyncio.sleep(_LOOK)
            if math.isfinite(self._told_at) and clock.now() - self._told_at > after:
                self._state, self._told_at = RobotState(), -math.inf
                self._cell.carried.unreported(self._others())

    def _others(self) -> list[int]:
        """The states that the server tells."""
        return [index for name, found in self._states.items() if name not in OWN for index in found]

    def _show(self, now: float) -> None:
        """Bring the states that the server told into the image; what it does not tell is not known."""
        known: dict[int, Value] = {}
        unknown: list[int] = []
        for name, value in values_of(self._state, self.plan).items():
            for index in self._states.get(name, ()):
                if value is None:
                    unknown.append(index)
                else:
                    known[index] = value
        self._cell.carried.report(known, now)
        self._cell.carried.unreported(unknown)

    def _show_own(self, now: float) -> None:
        own: dict[str, Value] = {"result": int(self._result), "connected": self.client.is_connected}
        self._cell.carried.report(
            {index: value for name, value in own.items() for index in self._states.get(name, ())}, now
        )
        self._show_words()

    def _show_words(self) -> None:
        is_up, is_local = self.client.is_connected, self._state.remote is False
        self._cell.health.words[STATE_WORD] = 1 if not is_up else 2 if is_local else 3
        self._cell.health.words[RESULT_WORD] = int(self._result)

    def _words(self) -> str:
        if not self.client.is_connected:
            return "not connected"
        remote = self._state.remote
        return "connected" if remote is None else "remote control" if remote else "local control"

    def _refuse(
        self, attempt: Attempt, result: CommandResult, answer: str | None = None, now: float | None = None
    ) -> None:
        time = attempt.time if now is None else now
        self._refused[result] += 1
        detail = result.words if answer is None else f"{result.words} ({answer})"
        event = self._event(EventKind.COMMAND_REFUSED, attempt, detail, time)
        self._reports.add(event, result, self._cell.events.append)
        self._conclude(result, answer, time)

    def _conclude(self, result: CommandResult, answer: str | None, now: float) -> None:
        self._result, self._answer = result, answer
        self._show_own(now)

    def _record(self, kind: EventKind, attempt: Attempt, detail: str, now: float | None = None) -> None:
        self._cell.events.append(self._event(kind, attempt, detail, attempt.time if now is None else now))

    @staticmethod
    def _event(kind: EventKind, attempt: Attempt, detail: str, now: float) -> Event:
        return Event(
            now, kind, variable=attempt.variable, writer=attempt.writer, new=attempt.value, detail=detail
        )
