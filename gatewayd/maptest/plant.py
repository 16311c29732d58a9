"""A cell with its robot and writers, all simulated: what the steps of a test act upon."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Value
from gatewayd.core.refusal import Refusal
from gatewayd.core.requester import Requester, new_connection
from gatewayd.maptest.explanation import Explanation
from gatewayd.maptest.robot import PlantRobot, typed

TICK = 0.02
"""Seconds between two looks of the core at the time, and between two packages of the robot: as in the daemon."""
REPEAT = 0.1
"""Seconds between two writes of a writer that repeats them."""
_MICROSECONDS = 1_000_000


class Plant:
    """One cell at a simulated time, which begins at 0 with the robot connected, its registers zero, and no writer."""

    def __init__(self, definition: CellDefinition) -> None:
        self.cell = Cell(definition)
        self.explanation = Explanation(self.cell)
        self.robot = PlantRobot(self.cell)
        self._microseconds = 0
        self._peers: dict[int, Requester] = {}
        """The writers that are connected."""
        self._distrusted: set[int] = set()
        """Writers that promised a heartbeat and lost it."""
        self.cell.adoption.reachable = True
        self.robot.connect(0.0)
        self.cell.tick(0.0)

    @property
    def now(self) -> float:
        """Simulated seconds since the test began."""
        return self._microseconds / _MICROSECONDS

    def wait(self, seconds: float, alive: Iterable[int] = ()) -> None:
        """Let time pass, tick by tick; these writers go on reading meanwhile."""
        end = self._microseconds + round(seconds * _MICROSECONDS)
        while self._microseconds < end:
            self._microseconds = min(self._microseconds + round(TICK * _MICROSECONDS), end)
            now = self.now
            for writer in alive:
                self.cell.writer_seen(self._asking(writer), now)
            self.robot.report(now)
            self.cell.tick(now)

    # -- writers -------------------------------------------------------------------------------------------------

    def connect(self, writer: int) -> None:
        """The writer connects, or its heartbeat is there again."""
        self._distrusted.discard(writer)
        self._asking(writer)

    def lose(self, writer: int) -> None:
        """The connection of the writer ends; of one that promised a heartbeat, that stays away from now on."""
        promised = self.cell.definition.writers[writer].heartbeat is not None
        peer = self._peers.pop(writer, None)
        if promised:
            self._distrusted.add(writer)
        if peer is not None:
            reason = "heartbeat lost" if promised else "connection closed"
            self.cell.writer_disconnected(peer, self.now, reason, at_once=promised)

    def write(self, writer: int, values: Mapping[int, Value]) -> Refusal | None:
        """All values in one request."""
        variables = self.cell.definition.variables
        changes = [Change(index, typed(variables[index], value)) for index, value in values.items()]
        return self.cell.write(self._asking(writer), changes, self.now)

    def take(self, writer: int, variables: Sequence[int]) -> Refusal | None:
        """Request the locks of these variables one after the other, up to the first refusal."""
        return self._each(variables, lambda index: self.cell.request(self._asking(writer), index, self.now))

    def release(self, writer: int, variables: Sequence[int]) -> Refusal | None:
        """The same for their release."""
        return self._each(variables, lambda index: self.cell.release(self._asking(writer), index, self.now))

    # -- local operator ------------------------------------------------------------------------------------------

    def take_as_operator(self, locks: Iterable[int]) -> None:
        """The local operator takes these locks without a time limit."""
        for lock in locks:
            self.cell.operator.take_lock(lock, self.now)

    def free_as_operator(self, locks: Iterable[int]) -> None:
        """The local operator releases these locks of any owner."""
        for lock in locks:
            self.cell.operator.free_lock(lock, self.now)

    def force(self, values: Mapping[int, Value]) -> Refusal | None:
        """Force these values without a time limit, up to the first refusal."""
        variables = self.cell.definition.variables

        def force(index: int) -> Refusal | None:
            value = typed(variables[index], values[index])
            return self.cell.operator.force(index, value, self.now, math.inf)

        return self._each(values, force)

    def unforce(self, variables: Iterable[int]) -> None:
        """End these forces, as far as there are any."""
        for index in variables:
            self.cell.operator.unforce(index, self.now)

    def _each(self, variables: Iterable[int], ask: Callable[[int], Refusal | None]) -> Refusal | None:
        return next((refusal for index in variables if (refusal := ask(index)) is not None), None)

    def _asking(self, writer: int) -> Requester:
        """The writer as it asks for something: connected by it, unless its heartbeat is lost."""
        if writer in self._distrusted:
            return Requester(writer, trusted=False)
        if writer not in self._peers:
            self._peers[writer] = Requester(writer, connection=new_connection())
            self.cell.writer_connected(self._peers[writer], self.now)
        return self._peers[writer]
