"""Heartbeat: ours as a sign that the core lives (1017h), the watch over others' (1016h; CiA 301, 7.2.8.2.2)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Entry, Object, array, variable
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.gap import spared
from gatewayd.canopen.nmt import NmtSlave, NmtState

MIN_CONSUMERS = 8
"""Entries of 1016h, or more if the mapping names more nodes."""


@dataclass(frozen=True, slots=True)
class Consumer:
    """A node whose heartbeat is watched (1016h)."""

    node: int
    timeout: int
    """Milliseconds."""
    writer: int | None
    """The writer that is lost with it."""


class HeartbeatProducer:
    """Sends the NMT state every 1017h milliseconds, but only while `alive(now)` says that the core lives."""

    def __init__(self, send: Send, nmt: NmtSlave, alive: Callable[[float], bool], milliseconds: int) -> None:
        self._send = send
        self._nmt = nmt
        self._alive = alive
        self._due = math.inf
        self._period = Entry.parameter(
            0, "Producer heartbeat time", CanType.UNSIGNED16, milliseconds, changed=self._changed
        )

    @property
    def enabled(self) -> bool:
        """Whether this node produces a heartbeat, and so does no guarding."""
        return self._period.number != 0

    def objects(self) -> Iterable[Object]:
        """1017h."""
        yield variable(0x1017, self._period)

    def restart(self, now: float) -> None:
        """The boot-up was sent, which counts as the first heartbeat."""
        self._due = now + self._period.number / 1000 if self.enabled else math.inf

    def resume(self, former: HeartbeatProducer) -> None:
        """Go on as another one: the next heartbeat comes when its next would have, at once where there was none."""
        if self.enabled:
            self._due = former._due if former.enabled else -math.inf

    def tick(self, now: float) -> None:
        """Send what is due. Heartbeats that were missed are not made up for."""
        if now < self._due:
            return
        period = self._period.number / 1000
        self._due = self._due + period if now < self._due + period else now + period
        frame = self.frame(now)
        if frame is not None:
            self._send(frame, Priority.NEWEST)

    def frame(self, now: float) -> Frame | None:
        """The heartbeat as it would be sent now; None if there is none."""
        if not self.enabled or self._nmt.state is NmtState.INITIALISING or not self._alive(now):
            return None
        return self._nmt.report()

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do."""
        return self._due

    def _changed(self) -> None:
        # A new time begins at once: the next tick sends.
        self._due = -math.inf if self.enabled else math.inf


class Watch(Enum):
    """How far a watched node is known."""

    WAITING = "no heartbeat yet"
    ALIVE = "heard in time"
    LOST = "silent for too long"


class Seen(Enum):
    """What happens to a watched node."""

    HEARTBEAT = "heartbeat"
    BOOT_UP = "boot-up"
    TIMEOUT = "consumer heartbeat time has passed"


WATCH: dict[tuple[Watch, Seen], Watch] = {
    (Watch.WAITING, Seen.HEARTBEAT): Watch.ALIVE,
    (Watch.ALIVE, Seen.HEARTBEAT): Watch.ALIVE,
    (Watch.ALIVE, Seen.BOOT_UP): Watch.WAITING,
    (Watch.ALIVE, Seen.TIMEOUT): Watch.LOST,
    (Watch.LOST, Seen.HEARTBEAT): Watch.ALIVE,
}
"""A pair that is not listed leaves the state. A node that boots is waited for again: supervision starts with its
first heartbeat (CiA 301, 7.5.2.19)."""


@dataclass(slots=True)
class _Watched:
    node: int
    timeout: float
    state: Watch = Watch.WAITING
    due: float = math.inf
    spared: bool = False
    """The process stood still since its last heartbeat."""


class HeartbeatConsumer:
    """Watches the nodes of 1016h, each from its first heartbeat on.

    `lost(node, now)`: its heartbeat is missing. `back(node, now)`: it is heard after it was lost, or its watch ended.
    `changed()`: other nodes or times are watched now.
    """

    def __init__(
        self,
        consumers: Sequence[Consumer],
        *,
        lost: Callable[[int, float], None],
        back: Callable[[int, float], None],
        changed: Callable[[], None],
    ) -> None:
        self._lost = lost
        self._back = back
        self._nodes_changed = changed
        self._stale = False
        defaults = [consumer.node << 16 | consumer.timeout for consumer in consumers]
        defaults += [0] * (MIN_CONSUMERS - len(consumers))
        self._entries = tuple(
            Entry.parameter(
                number,
                f"Consumer heartbeat time {number}",
                CanType.UNSIGNED32,
                default,
                check=partial(self._check, number),
                changed=self._mark,
            )
            for number, default in enumerate(defaults, 1)
        )
        self._watched = self._configured()

    @property
    def nodes(self) -> frozenset[int]:
        """The watched nodes."""
        return frozenset(self._watched)

    def objects(self) -> Iterable[Object]:
        """1016h."""
        yield array(0x1016, "Consumer heartbeat time", self._entries)

    def state(self, node: int) -> Watch | None:
        """How far a node is known; None if it is not watched."""
        return self._watched[node].state if node in self._watched else None

    def time(self, node: int) -> float:
        """Seconds for which a node may be silent; infinity if it is not watched."""
        return self._watched[node].timeout if node in self._watched else math.inf

    def gap(self, since: float, now: float) -> None:
        """The process stood still and received nothing: each living node has its time again."""
        for watched in self._watched.values():
            if watched.state is Watch.ALIVE:
                watched.due = spared(watched.due, watched.timeout, since, now, again=watched.spared)
                watched.spared = True

    def restart(self, now: float) -> None:
        """Wait for every node's first heartbeat anew, without a word about those that were lost."""
        self._watched = self._configured()
        self._stale = False
        self._nodes_changed()

    def resume(self, former: HeartbeatConsumer) -> None:
        """Go on watching as another consumer did, where both watch the same."""
        for watched in former._watched.values():
            self._keep(watched)

    def receive(self, frame: Frame, now: float) -> None:
        """A frame with COB-ID 700h + node-ID."""
        watched = self._watched.get(frame.can_id - Function.ERROR_CONTROL)
        if watched is None or frame.remote or len(frame.data) != 1:
            return
        # Bit 7 is the toggle bit of a node that answers guarding: no heartbeat has it.
        self._see(watched, Seen.BOOT_UP if frame.data[0] == NmtState.INITIALISING else Seen.HEARTBEAT, now)

    def tick(self, now: float) -> None:
        """Adopt a changed 1016h, notice silence."""
        if self._stale:
            self._adopt(now)
        for watched in list(self._watched.values()):
            if now >= watched.due:
                self._see(watched, Seen.TIMEOUT, now)

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do."""
        if self._stale:
            return -math.inf
        return min((watched.due for watched in self._watched.values()), default=math.inf)

    def _see(self, watched: _Watched, seen: Seen, now: float) -> None:
        old = watched.state
        watched.state = WATCH.get((old, seen), old)
        watched.due = now + watched.timeout if watched.state is Watch.ALIVE else math.inf
        watched.spared = False
        if old is Watch.LOST and watched.state is Watch.ALIVE:
            self._back(watched.node, now)
        elif old is not Watch.LOST and watched.state is Watch.LOST:
            self._lost(watched.node, now)

    def _adopt(self, now: float) -> None:
        """Changed entries wait for their first heartbeat; the others go on as they were."""
        self._stale = False
        old, self._watched = self._watched, self._configured()
        for watched in old.values():
            if not self._keep(watched) and watched.state is Watch.LOST:
                self._back(watched.node, now)
        self._nodes_changed()

    def _keep(self, watched: _Watched) -> bool:
        """Go on with a node as it stands, if it is still watched, and for the same time."""
        if self.time(watched.node) != watched.timeout:
            return False
        self._watched[watched.node] = watched
        return True

    def _configured(self) -> dict[int, _Watched]:
        found = {}
        for entry in self._entries:
            node, milliseconds = _split(entry.number)
            if node and milliseconds:
                found[node] = _Watched(node, milliseconds / 1000)
        return found

    def _check(self, subindex: int, data: bytes) -> None:
        number = int.from_bytes(data, "little")
        if number >> 16 > 127:
            raise Abort(AbortCode.INVALID_VALUE)
        node, milliseconds = _split(number)
        others = (_split(entry.number) for entry in self._entries if entry.subindex != subindex)
        if node and milliseconds and any(other == node and time for other, time in others):
            raise Abort(AbortCode.PARAMETER_INCOMPATIBLE)

    def _mark(self) -> None:
        self._stale = True


def _split(number: int) -> tuple[int, int]:
    """The node and the milliseconds in an entry of 1016h; either is 0 where nobody is watched."""
    return number >> 16 & 0xFF, number & 0xFFFF
