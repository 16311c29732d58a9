"""What a received RPDO does (CiA 301, 7.2.2 and 7.5.2.35): one write of the cell, whole or not at all.

An RPDO of type 254 or 255 is written at once. One of type 0-240 is kept, the newest replacing what is kept, and written
with the next SYNC, if its writer still lives. Both only in OPERATIONAL.

| cause | what becomes of the frame | fault |
|---|---|---|
| shorter than the mapping | dropped | 8210h |
| longer than the mapping | its first bytes are used | 8220h |
| none for the event time, after a first one | | 8250h |
| the cell refuses the write | dropped | FF01h-FF09h by reason |
| it waited too long while the gateway stood still | dropped, and the locks that it would have renewed are released \
| FF08h |

Each fault is reported once per PDO. It is cleared by the opposite: a frame of the right length, any usable frame, a
write that succeeds; and when the PDO is no longer received (configured anew, OPERATIONAL left). While the writer's
heartbeat stays away its frames are refused as they come, whatever the type: none is kept for SYNC.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from enum import Enum
from typing import Final

from gatewayd.canopen.gap import spared
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.core.prepared import PreparedWrite
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from gatewayd.links.canopen_node.pdo.parameters import Configuration
from gatewayd.report.format import counted


class Fault(Enum):
    """What is wrong with an RPDO; the value is its EMCY error code."""

    SHORT = 0x8210
    LONG = 0x8220
    TIMEOUT = 0x8250
    HELD = 0xFF01
    OUT_OF_LIMITS = 0xFF02
    ROBOT_LOST = 0xFF03
    CLAIMED_ELSEWHERE = 0xFF04
    NOT_WRITABLE = 0xFF05
    HEARTBEAT_LOST = 0xFF06
    PARTIAL_TAKEOVER = 0xFF07
    WAITED = 0xFF08
    CONTRADICTED = 0xFF09

    @property
    def is_refusal(self) -> bool:
        """Whether the cell refused the write."""
        return self.value >= 0xFF00


_FAULTS: Final = {Reason[fault.name]: fault for fault in Fault if fault.is_refusal}
"""The reasons that a write of whole, mapped variables can be refused for."""

ReportFault = Callable[[Fault, int, float], None]
"""Takes a fault, the number of the RPDO, and the time."""


class ReceivePdo:
    """One valid RPDO and what is known of the last reception."""

    def __init__(self, configuration: Configuration, cell: Cell) -> None:
        self.configuration = configuration
        self.size = configuration.layout.size
        self.faults: set[Fault] = set()
        """What is wrong now."""
        self.latched: bytes | None = None
        """What waits for SYNC."""
        self.waited = 0.0
        """Seconds for which that may have waited while the process stood still."""
        self.due = math.inf
        """When the deadline passes; infinity before the first frame and after a time-out."""
        self.spared = False
        """The process stood still since the last frame."""
        self.data: bytes | None = None
        """What `decoded` was made of. Masters repeat themselves, so that it is worth keeping."""
        self.decoded: list[Value] | Refusal = []
        self._cell = cell
        self._prepared: PreparedWrite | None = None
        with suppress(ValueError):  # it maps a variable twice
            self._prepared = PreparedWrite(cell, configuration.layout.variables)

    def write(self, requester: Requester, data: bytes, now: float) -> Refusal | None:
        """Write what the bytes say, or return why not."""
        if data != self.data:
            self.decoded = self.configuration.layout.values(data)
            self.data = data
        decoded, prepared = self.decoded, self._prepared
        if prepared is not None and isinstance(decoded, list) and prepared.write(requester, decoded, now):
            return None
        changes = decoded if isinstance(decoded, Refusal) else self.configuration.layout.meant(decoded)
        if isinstance(changes, Refusal):
            self._cell.refuse(requester, changes, now)
            return changes
        return self._cell.write(requester, changes, now)


class ReceiveEngine:
    """All RPDOs of a node.

    An RPDO writes as `asking(number, now)` when a frame of it comes, and as `requester(number)` with SYNC. Each frame
    of the right length is a sign of life of a trusted writer, whether its write is refused or not. `raised` and
    `cleared` are called for each fault of each PDO.
    """

    def __init__(
        self,
        cell: Cell,
        asking: Callable[[int, float], Requester],
        requester: Callable[[int], Requester],
        raised: ReportFault,
        cleared: ReportFault,
    ) -> None:
        self.is_operational = False
        self.synchronous_ids: frozenset[int] = frozenset()
        """The identifiers of RPDOs that all wait for SYNC."""
        self._cell = cell
        self._asking = asking
        self._requester = requester
        self._raised = raised
        self._cleared = cleared
        self._pdos: dict[int, ReceivePdo] = {}
        self._by_can_id: dict[int, tuple[ReceivePdo, ...]] = {}
        self._synchronous: tuple[ReceivePdo, ...] = ()
        self._deadline: float | None = math.inf
        self._now = 0.0
        """The time of the last call, for `configure`."""

    @property
    def pdos(self) -> tuple[ReceivePdo, ...]:
        """The valid RPDOs by number."""
        return tuple(self._pdos[number] for number in sorted(self._pdos))

    @property
    def can_ids(self) -> frozenset[int]:
        """The identifiers to listen to."""
        return frozenset(self._by_can_id)

    def configure(self, number: int, configuration: Configuration | None) -> None:
        """An RPDO is now like this; None: it does not exist. What is kept for SYNC is dropped."""
        former = self._pdos.pop(number, None)
        if former is not None:
            self._clear(former, tuple(former.faults), self._now)
        if configuration is not None:
            self._pdos[number] = ReceivePdo(configuration, self._cell)
        by_can_id: dict[int, tuple[ReceivePdo, ...]] = {}
        for pdo in self.pdos:
            can_id = pdo.configuration.can_id
            by_can_id[can_id] = (*by_can_id.get(can_id, ()), pdo)
        self._by_can_id = by_can_id
        self._synchronous = tuple(pdo for pdo in self.pdos if pdo.configuration.is_synchronous)
        immediate = {pdo.configuration.can_id for pdo in self.pdos if not pdo.configuration.is_synchronous}
        self.synchronous_ids = self.can_ids - immediate
        self._deadline = None

    def nmt(self, operational: bool, now: float) -> None:
        """OPERATIONAL was entered or left."""
        self._now = now
        if operational == self.is_operational:
            return
        self.is_operational = operational
        for pdo in self._pdos.values():
            pdo.latched = None
            pdo.due = math.inf
            self._clear(pdo, tuple(pdo.faults), now)
        self._deadline = math.inf

    def resume(self, former: ReceiveEngine) -> None:
        """Go on as another one with the same RPDOs: their deadlines run, what was wrong still is.

        A deadline of another length begins anew.
        """
        for number, pdo in self._pdos.items():
            before = former._pdos.get(number)
            if before is not None:
                pdo.faults = before.faults
                pdo.latched, pdo.waited = before.latched, before.waited
                pdo.due, pdo.spared = before.due, before.spared
                event = pdo.configuration.event
                if event != before.configuration.event and pdo.due < math.inf:
                    pdo.due = self._now + event if event else math.inf
        self._deadline = None

    def receive(self, can_id: int, data: bytes, now: float) -> bool:
        """A data frame. Returns whether an RPDO has this identifier."""
        pdos = self._by_can_id.get(can_id)
        if pdos is None:
            return False
        self._now = now
        if self.is_operational:
            for pdo in pdos:
                self._take(pdo, data, now, self._asking(pdo.configuration.number, now))
        return True

    def on_sync(self, now: float) -> None:
        """A SYNC was received: write what was kept for it, unless the writer was lost meanwhile."""
        self._now = now
        for pdo in self._synchronous:
            if pdo.latched is not None:
                data, pdo.latched = pdo.latched, None
                requester = self._requester(pdo.configuration.number)
                if requester.writer is not None and not self._cell.writers.alive[requester.writer]:
                    continue
                self._write(pdo, data, now, replace(requester, waited=pdo.waited))

    def forget(self) -> None:
        """Nobody is heard any more: what was left for the next SYNC is nobody's."""
        for pdo in self._synchronous:
            pdo.latched = None

    def forget_of(self, writer: int | None) -> None:
        """The writer is lost: what it left for the next SYNC is nobody's any more."""
        for pdo in self._synchronous:
            if pdo.latched is not None and self._requester(pdo.configuration.number).writer == writer:
                pdo.latched = None

    def gap(self, since: float, now: float) -> None:
        """The process stood still: what is kept for SYNC has waited, and deadlines count anew."""
        self._now = now
        for pdo in self._pdos.values():
            pdo.waited += now - since
            if pdo.due < math.inf:
                pdo.due = spared(pdo.due, pdo.configuration.event, since, now, again=pdo.spared)
                pdo.spared = True
        self._deadline = None

    def tick(self, now: float) -> None:
        """Notice deadlines that have passed. Cheap before `next_deadline`."""
        self._now = now
        if now < self.next_deadline():
            return
        for pdo in self._pdos.values():
            if now >= pdo.due:
                pdo.due = math.inf
                self._raise(pdo, Fault.TIMEOUT, now)
        self._deadline = None

    def next_deadline(self, now: float = 0.0) -> float:
        """When `tick` is wanted, not before `now`; infinity if never. It may turn out then that nothing is due yet."""
        if self._deadline is None:
            self._deadline = min((pdo.due for pdo in self._pdos.values()), default=math.inf)
        return max(self._deadline, now)

    # -- inside --------------------------------------------------------------------------------------------------

    def _take(self, pdo: ReceivePdo, data: bytes, now: float, requester: Requester) -> None:
        length = len(data)
        if length < pdo.size:
            self._raise(pdo, Fault.SHORT, now)
            self._report_length(pdo, length, "dropped", now, requester)
            return
        if length > pdo.size:
            self._raise(pdo, Fault.LONG, now)
            self._report_length(pdo, length, "the rest is ignored", now, requester)
            data = data[: pdo.size]
        if pdo.faults:
            good = {Fault.SHORT, Fault.LONG, Fault.TIMEOUT}
            self._clear(pdo, good if length == pdo.size else good - {Fault.LONG}, now)
        pdo.spared = False
        event = pdo.configuration.event
        if event:
            pdo.due = now + event
            if self._deadline is not None:
                self._deadline = min(self._deadline, pdo.due)
        self._cell.writer_seen(requester, now)
        if pdo.configuration.is_synchronous and requester.trusted:
            pdo.latched = data
            pdo.waited = requester.waited
        else:
            self._write(pdo, data, now, requester)

    def _report_length(
        self, pdo: ReceivePdo, length: int, what: str, now: float, requester: Requester
    ) -> None:
        text = f"sent RPDO {pdo.configuration.number} with {counted(length, 'byte')} instead of {pdo.size}: {what}"
        self._cell.unserved(requester, Unserved.MALFORMED, text, now)

    def _write(self, pdo: ReceivePdo, data: bytes, now: float, requester: Requester) -> None:
        refusal = pdo.write(requester, data, now)
        if refusal is not None:
            if refusal.reason is Reason.WAITED:
                self._cell.drop_waited(requester, pdo.configuration.layout.variables, now)
            self._raise(pdo, _FAULTS[refusal.reason], now)
        elif pdo.faults:
            self._clear(pdo, [fault for fault in pdo.faults if fault.is_refusal], now)

    def _raise(self, pdo: ReceivePdo, fault: Fault, now: float) -> None:
        if fault not in pdo.faults:
            pdo.faults.add(fault)
            self._raised(fault, pdo.configuration.number, now)

    def _clear(self, pdo: ReceivePdo, faults: Iterable[Fault], now: float) -> None:
        for fault in sorted(pdo.faults.intersection(faults), key=lambda fault: fault.value):
            pdo.faults.discard(fault)
            self._cleared(fault, pdo.configuration.number, now)
