"""Node guarding and life guarding, answered for old masters while no heartbeat is produced (CiA 301, 7.2.8.2.1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Entry, Object, variable
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.gap import spared
from gatewayd.canopen.nmt import NmtSlave, NmtState

TOGGLE = 0x80
"""Bit of the answer that changes with every request."""


class NodeGuarding:
    """Answers remote frames on 700h + node-ID, and misses them if they stay away for the node life time.

    The life time is 100Ch milliseconds times 100Dh, after power-on `time` and `factor`; supervision begins with the
    first request. `lost(now)` and `back(now)` are called for the master. Nothing happens while `heartbeat()` says that
    this node produces a heartbeat.
    """

    def __init__(
        self,
        send: Send,
        nmt: NmtSlave,
        heartbeat: Callable[[], bool],
        *,
        lost: Callable[[float], None],
        back: Callable[[float], None],
        time: int = 0,
        factor: int = 0,
    ) -> None:
        self._send = send
        self._nmt = nmt
        self._heartbeat = heartbeat
        self._lost = lost
        self._back = back
        self._spared = False
        self.restart()
        self._time = Entry.parameter(0, "Guard time", CanType.UNSIGNED16, time, changed=self._supervise)
        self._factor = Entry.parameter(
            0, "Life time factor", CanType.UNSIGNED8, factor, changed=self._supervise
        )

    def objects(self) -> Iterable[Object]:
        """100Ch and 100Dh."""
        yield variable(0x100C, self._time)
        yield variable(0x100D, self._factor)

    def restart(self) -> None:
        """Begin with toggle bit 0 and without supervision."""
        self._toggle = 0
        self._due = math.inf
        self._asked = -math.inf
        self._is_lost = False

    def resume(self, former: NodeGuarding) -> None:
        """Go on as another one: a master that was asking is watched, one that was missed is missed still."""
        self._toggle, self._asked = former._toggle, former._asked
        self._is_lost, self._spared = former._is_lost, former._spared
        self._supervise()

    def receive(self, frame: Frame, now: float, *, late: bool = False) -> None:
        """A frame with this node's error control COB-ID; only remote frames mean anything.

        `late`: it waited while the process stood still. It is a sign of the master, who waits for no answer any more.
        """
        if not frame.remote or self._heartbeat() or self._nmt.state is NmtState.INITIALISING:
            return
        if not late:
            self._send(self._nmt.report(self._toggle), Priority.NEWEST)
            self._toggle ^= TOGGLE
        self._asked = now
        self._spared = False
        was_lost, self._is_lost = self._is_lost, False
        self._supervise()
        if was_lost:
            self._back(now)

    def gap(self, since: float, now: float) -> None:
        """The process stood still and received nothing: a master that was asking has its time again."""
        if self._due < math.inf:
            self._asked = spared(self._asked, 0.0, since, now, again=self._spared)
            self._spared = True
            self._supervise()

    def tick(self, now: float) -> None:
        """Notice that the master has stopped asking."""
        if now < self._due:
            return
        self._due = math.inf
        if not self._heartbeat() and not self._is_lost:
            self._is_lost = True
            self._lost(now)

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do."""
        return self._due

    def _supervise(self) -> None:
        life = self._time.number * self._factor.number / 1000
        watched = life > 0 and self._asked > -math.inf and not self._is_lost
        self._due = self._asked + life if watched else math.inf
