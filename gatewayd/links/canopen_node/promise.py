"""What the mapping says of a writer's heartbeat (`writers.*.node`, `writers.*.heartbeat`), whatever 1016h says.

It stands apart from the supervision by CiA 301 (`gatewayd.canopen.heartbeat`), which begins with the first heartbeat
and leads to EMCY 8130h and 1029h. What a writer promised begins to bind it with its first write or lock request, and
its breach costs the writer its locks, and its requests are refused until its heartbeat is back. A read begins nothing.

1016h can be written from the bus. It can make the time shorter, but neither longer nor endless. A writer that promises
to guard this node (`writers.*.guarding`) is held to it alike; its requests take the place of heartbeats.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.gap import spared
from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.nmt import NmtState
from gatewayd.links.canopen_node.plan import GUARDING


class Promise(Enum):
    """How a node stands to what was promised for it."""

    IDLE = "its writers have written nothing since it booted"
    OWED = "they have written, and its heartbeat is awaited"
    KEPT = "its heartbeat comes in time"
    BROKEN = "its heartbeat is missing"


class Sign(Enum):
    """What is seen of a node."""

    WRITE = "a write or a lock request of one of its writers"
    HEARTBEAT = "heartbeat"
    BOOT_UP = "boot-up"
    TIMEOUT = "the promised time has passed"


PROMISE: dict[tuple[Promise, Sign], Promise] = {
    (Promise.IDLE, Sign.WRITE): Promise.OWED,
    (Promise.OWED, Sign.HEARTBEAT): Promise.KEPT,
    (Promise.OWED, Sign.BOOT_UP): Promise.IDLE,
    (Promise.OWED, Sign.TIMEOUT): Promise.BROKEN,
    (Promise.KEPT, Sign.BOOT_UP): Promise.IDLE,
    (Promise.KEPT, Sign.TIMEOUT): Promise.BROKEN,
    (Promise.BROKEN, Sign.HEARTBEAT): Promise.KEPT,
}
"""A pair that is not listed leaves the state. Writes after the first one prolong nothing: else a writer that comes and
goes would never be missed. A node that was missed comes back by its heartbeat alone, not by booting."""

_BOUND = (Promise.OWED, Promise.KEPT)


@dataclass(slots=True)
class _Node:
    node: int
    timeout: float
    """Seconds that the mapping gives."""
    writers: tuple[int, ...]
    state: Promise = Promise.IDLE
    since: float = math.inf
    """The last heartbeat, or the write that began it; later, if we stood still since."""
    spared: bool = False
    """We stood still since."""


class Promises:
    """The promises of the writers of one cell.

    `also(node)`: seconds that 1016h gives the node, infinity for none. `broken(node, now)`: it is missed.
    `booted(node, now)`: it has restarted, and what its writers wrote before is nobody's any more.
    """

    def __init__(
        self,
        consumers: Iterable[Consumer],
        *,
        also: Callable[[int], float],
        broken: Callable[[int, float], None],
        booted: Callable[[int, float], None],
    ) -> None:
        self._also = also
        self._broken = broken
        self._booted = booted
        found: dict[int, _Node] = {}
        for consumer in consumers:
            if consumer.writer is not None:
                timeout = consumer.timeout / 1000
                known = found.get(consumer.node, _Node(consumer.node, timeout, ()))
                writers = (*known.writers, consumer.writer)
                found[consumer.node] = _Node(consumer.node, min(known.timeout, timeout), writers)
        self._nodes = found
        self._weaker: frozenset[tuple[int, float]] = frozenset()
        """What was reported: nodes to which 1016h gives more than the mapping, and how much."""
        self._of = {writer: node for node in found.values() for writer in node.writers}

    @property
    def nodes(self) -> frozenset[int]:
        """The nodes whose heartbeat was promised."""
        return frozenset(self._nodes)

    def of(self, node: int) -> tuple[int, ...]:
        """The writers that promised this node's heartbeat."""
        found = self._nodes.get(node)
        return found.writers if found is not None else ()

    def node(self, writer: int | None) -> int | None:
        """The node whose heartbeat the writer promised; None: it promised nothing."""
        found = self._of.get(writer) if writer is not None else None
        return found.node if found is not None else None

    def state(self, node: int) -> Promise | None:
        """How the node stands to it; None where nothing was promised."""
        found = self._nodes.get(node)
        return found.state if found is not None else None

    def write(self, writer: int | None, now: float) -> None:
        """The writer asks for a write or a lock."""
        found = self._of.get(writer) if writer is not None else None
        if found is not None:
            self._see(found, Sign.WRITE, now)

    def receive(self, frame: Frame, now: float) -> bool:
        """A frame with COB-ID 700h + node-ID. Returns whether it is the heartbeat of a promised node."""
        found = self._nodes.get(frame.can_id - Function.ERROR_CONTROL)
        if found is None or frame.remote or len(frame.data) != 1:
            return False
        boots = frame.data[0] == NmtState.INITIALISING
        self._see(found, Sign.BOOT_UP if boots else Sign.HEARTBEAT, now)
        if boots:
            self._booted(found.node, now)
        return not boots

    def heard(self, node: int, now: float) -> None:
        """Another sign of life than a heartbeat: what guards this node asks it."""
        found = self._nodes.get(node)
        if found is not None:
            self._see(found, Sign.HEARTBEAT, now)

    def restart(self) -> None:
        """NMT reset: what was promised binds from the next write on."""
        for found in self._nodes.values():
            found.state, found.since = Promise.IDLE, math.inf

    def resume(self, former: Promises) -> None:
        """Go on as another one of the same plan."""
        self._weaker = former._weaker
        for node, found in former._nodes.items():
            if node in self._nodes:
                present = self._nodes[node]
                present.state, present.since, present.spared = found.state, found.since, found.spared

    def weakened(self, names: Sequence[str]) -> list[str]:
        """What is to be reported of 1016h after a change: where it is weaker than the mapping. Each is reported once.

        `names`: those of the writers.
        """
        weaker = frozenset(
            (node, self._also(node))
            for node, found in self._nodes.items()
            if node != GUARDING and self._also(node) > found.timeout
        )
        news, self._weaker = weaker - self._weaker, weaker
        return [self._comparison(self._nodes[node], time, names) for node, time in sorted(news)]

    @staticmethod
    def _comparison(found: _Node, time: float, names: Sequence[str]) -> str:
        watched = "does not watch" if time == math.inf else f"allows {time * 1000:.0f} ms of silence to"
        writers = ", ".join(names[writer] for writer in found.writers)
        promised = f"{found.timeout * 1000:.0f} ms"
        return (
            f"1016h {watched} node {found.node}; the {promised} of the mapping hold for its writer {writers}"
        )

    def gap(self, since: float, now: float) -> None:
        """The process stood still and received nothing: each bound node has its time again."""
        for found in self._nodes.values():
            if found.state in _BOUND:
                found.since = spared(found.since, 0.0, since, now, again=found.spared)
                found.spared = True

    def tick(self, now: float) -> None:
        """Notice silence."""
        for found in self._nodes.values():
            if now >= self._due(found):
                self._see(found, Sign.TIMEOUT, now)

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do."""
        return min(map(self._due, self._nodes.values()), default=math.inf)

    def _due(self, found: _Node) -> float:
        if found.state not in _BOUND:
            return math.inf
        return found.since + min(found.timeout, self._also(found.node))

    def _see(self, found: _Node, sign: Sign, now: float) -> None:
        old = found.state
        found.state = PROMISE.get((old, sign), old)
        if sign is Sign.HEARTBEAT or (found.state is Promise.OWED and old is not Promise.OWED):
            found.since = now
            found.spared = False
        if found.state is Promise.BROKEN and old is not Promise.BROKEN:
            self._broken(found.node, now)
