"""A scenario at work: the commands of one robot, each in the control cycle in which it is due.

Time counts in control cycles since the start, so what happens depends on nothing else: at another speed, stepped, while
the controller's own timestamp is frozen, and after it has booted again.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Iterable
from typing import Any, NamedTuple

from gatewayd.simulator.control import Action, Control
from gatewayd.simulator.scenario import ScenarioEntry, ScenarioError, ScenarioRobot
from gatewayd.simulator.server import SimulatedController

_KEPT = 100  # problems
_log = logging.getLogger(__name__)


class _Due(NamedTuple):
    cycle: int
    action: Action
    entry: ScenarioEntry


class Timeline:
    """The timeline of one robot; ScenarioError for the first line that is no command of it."""

    def __init__(self, simulator: SimulatedController, robot: ScenarioRobot, file: str) -> None:
        self.problems: deque[str] = deque(maxlen=_KEPT)
        """What the robot refused when it was due, with file and line; the newest."""
        self._file = file
        self._simulator = simulator
        self._controller = simulator.controller
        self._waiting = robot.begin == "client"
        control, rate = Control(simulator), simulator.controller.rate
        self._start = self._read(control, rate, robot.start)
        self._entries = self._read(control, rate, robot.timeline)
        self._repeat = None if robot.repeat is None else max(1, round(robot.repeat * rate))
        self._next = 0
        self._origin = simulator.controller.cycle
        self._tasks: set[asyncio.Future[Any]] = set()

    def begin(self) -> None:
        """Put the robot into the state that it has at the start."""
        for due in self._start:
            self._do(due)
        self._controller.modes.finish()

    def follow(self, cycle: int) -> None:
        """Do what is due by this cycle."""
        if self._waiting:
            if not self._simulator.streaming:
                return
            self._waiting, self._origin = False, cycle
        if self._repeat is not None and cycle - self._origin >= self._repeat:
            self._until(self._origin + self._repeat)
            self._origin += (cycle - self._origin) // self._repeat * self._repeat
            self._next = 0
        self._until(cycle)

    async def settle(self) -> None:
        """Returns when nothing is left that takes a while, as `restart` does."""
        while self._tasks:
            await asyncio.wait(self._tasks)

    def close(self) -> None:
        """Leave what has not been done."""
        for task in self._tasks:
            task.cancel()

    def _read(self, control: Control, rate: float, entries: Iterable[ScenarioEntry]) -> list[_Due]:
        found = []
        for entry in entries:
            if entry.command.split()[0] in _NOT_HERE:
                message = f"`{entry.command}`: of no use in a scenario; give it on standard input"
                raise ScenarioError(self._file, entry.line, message)
            try:
                action = control.prepare(entry.command)
            except ValueError as error:
                raise ScenarioError(self._file, entry.line, f"`{entry.command}`: {error}") from None
            found.append(_Due(round(entry.at * rate), action, entry))
        return found

    def _until(self, cycle: int) -> None:
        while self._next < len(self._entries) and self._entries[self._next].cycle <= cycle - self._origin:
            due = self._entries[self._next]
            self._next += 1
            self._do(due)

    def _do(self, due: _Due) -> None:
        try:
            result = due.action()
        except ValueError as error:
            problem = f"{self._file}:{due.entry.line}: `{due.entry.command}`: {error}"
            self.problems.append(problem)
            _log.warning("%s", problem)
            return
        _log.info("%s:%d: %s", self._file, due.entry.line, due.entry.command)
        if isinstance(result, Awaitable):
            task = asyncio.ensure_future(result)
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)


_NOT_HERE = {"get", "clients", "step", "quit"}
