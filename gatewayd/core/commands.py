"""Commands: inputs that act once, at the moment at which their owner means it, and never by themselves.

A command acts where its owner writes a value other than 0 after it wrote 0, both explicitly, by one connection, and
without having lost the lock in between; nothing else makes it act. What is held at 1 does nothing; what rises otherwise
is reported with the obstacle, so that nobody waits for a robot that never got it.

| written | nobody has written 0 | its 0 stands | it is held |
|---|---|---|---|
| 0, explicitly | its 0 stands | its 0 stands | its 0 stands |
| 0, implied | - | - | nobody has written 0 |
| n, explicitly, by whose 0 it is | obstacle; held | acts; held | nothing, unless n is another |
| n otherwise | obstacle; held | obstacle; held | nothing, unless n or the writer is another |

A lock that changes hands, a session that begins or ends, a reload: nobody has written 0. Adoption, takeover, fallbacks
and forces change the image and are no writes, so they cannot make a command act.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from gatewayd.core.admission import Change
from gatewayd.core.definition import Value, Variable
from gatewayd.core.ownership import LockTable
from gatewayd.core.requester import Requester

MAX_WAITED = 0.5
"""Seconds for which a command may have waited while the gateway stood still; nobody expects it later."""


class Obstacle(Enum):
    """Why a command that was written does not act, in words."""

    NOT_CLEARED = "its owner has to write 0 before, by the same connection"
    IMPLIED = "it was written only because it shares a register"
    WAITED = "it waited while the gateway stood still"


@dataclass(frozen=True, slots=True)
class Attempt:
    """A command was written with a value other than 0."""

    variable: int
    value: Value
    writer: int
    time: float
    obstacle: Obstacle | None
    """None: it acts."""


_Hand = tuple[int | None, int, int]
"""Whose a write is: writer, connection, and the tenure of the lock (`LockTable.tenures`)."""


@dataclass(slots=True)
class _State:
    """What was written last: nothing (`hand` None), its 0, or a value that is held."""

    hand: _Hand | None = None
    held: Value = 0


class Commands:
    """The commands of one cell, by index of the variable."""

    def __init__(self, variables: Sequence[Variable], ownership: LockTable) -> None:
        self._variables = variables
        self._ownership = ownership
        self._states = {index: _State() for index, variable in enumerate(variables) if variable.is_command}
        self.listeners: list[Callable[[Attempt], None]] = []
        """Called with every attempt, after its write was accepted. They must not raise."""

    @property
    def indices(self) -> tuple[int, ...]:
        """The variables that are commands."""
        return tuple(self._states)

    def written(self, requester: Requester, changes: Iterable[Change], now: float) -> None:
        """A request was accepted, and its locks have moved. Cheap where a cell has no commands."""
        if not self._states:
            return
        attempts = [
            attempt
            for change in changes
            if change.variable in self._states
            and (attempt := self._judge(requester, change, now)) is not None
        ]
        for attempt in attempts:
            for listener in self.listeners:
                listener(attempt)

    def disarm(self, indices: Iterable[int] | None = None) -> None:
        """Whatever was written of these commands (None: of all) does not count any more."""
        for index in self._states if indices is None else indices:
            self._states[index] = _State()

    def at_rest(self, indices: Iterable[int]) -> dict[int, Value]:
        """What a robot holds of these commands: nothing, whatever was commanded before."""
        return {index: self._variables[index].kind.zero for index in indices}

    def _judge(self, requester: Requester, change: Change, now: float) -> Attempt | None:
        state, lock = self._states[change.variable], self._variables[change.variable].lock
        writer = requester.writer
        assert lock is not None
        assert writer is not None
        if self._ownership.owners[lock] != writer:
            return None  # implied and unchanged: it was let pass unwritten
        hand = (writer, requester.connection, self._ownership.tenures[lock])
        if not change.value:
            if not change.implied:
                state.hand, state.held = hand, 0
            elif state.held:
                state.hand, state.held = None, 0
            return None
        if state.held == change.value and state.hand == hand:
            return None
        obstacle = self._obstacle(requester, change, cleared=state.hand == hand and not state.held)
        state.hand, state.held = hand, change.value
        return Attempt(change.variable, change.value, writer, now, obstacle)

    def _obstacle(self, requester: Requester, change: Change, *, cleared: bool) -> Obstacle | None:
        if change.implied:
            return Obstacle.IMPLIED
        if requester.waited > MAX_WAITED:
            return Obstacle.WAITED
        return None if cleared else Obstacle.NOT_CLEARED
