"""One device as its manager keeps it: booted, watched, asked, and its PDOs exchanged. Pure: frames and time come in.

What the device says goes to a `NodeObserver`. Values are exchanged only while it is in operation: a PDO that comes
earlier is dropped, and nothing is sent to a device that would not take it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from functools import partial

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.datatypes import CanType, Value
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.gap import spared
from gatewayd.canopen.heartbeat import WATCH, Seen, Watch
from gatewayd.canopen.manager.boot import Boot
from gatewayd.canopen.manager.boot_steps import BootStep
from gatewayd.canopen.manager.channel import Done, SdoChannel, SdoJob, reason_of
from gatewayd.canopen.manager.emergency_text import EmergencyMessage, read_emergency
from gatewayd.canopen.manager.letters import BootError
from gatewayd.canopen.manager.pdo_content import PdoContent
from gatewayd.canopen.manager.plan import ManagedPdo, NodePlan, ObjectReading
from gatewayd.canopen.nmt import NmtCommand, NmtState
from gatewayd.canopen.sdo.client import SdoResult

DRIFT = 1.0
"""Seconds, or its heartbeat time if that is longer, after which a device that has left OPERATIONAL is booted again."""
FULL = 1.0
"""Seconds until an object is read again for which there was no room among what waits."""


class NodeCondition(Enum):
    """How a device is, in the words that people read."""

    ABSENT = "not answering"
    BOOTING = "booting"
    READY = "ready, waits for a mandatory device"
    OPERATIONAL = "operational"
    FAILED = "failed"
    OFFLINE = "bus away"


@dataclass(slots=True)
class ManagedCounters:
    """What has happened to a device since the manager knows it."""

    boots: int = 0
    """Completed boots."""
    boot_ups: int = 0
    """Boot-up messages."""
    heartbeat_misses: int = 0
    emergencies: int = 0
    pdos_received: int = 0
    pdos_sent: int = 0
    pdos_short: int = 0
    """TPDOs with fewer bytes than their layout, which are dropped."""


class NodeObserver:
    """To whom a device's manager reports. Any method may be overridden; none may raise. `now` is monotonic seconds."""

    def node_started(self, now: float) -> None:
        """The device is in operation: values may be written."""

    def node_ended(self, reason: str, now: float) -> None:
        """It is not any more."""

    def node_seen(self, now: float) -> None:
        """It is in operation and lives: a heartbeat, or an answer of a device that has none."""

    def pdo_received(self, pdo: int, values: list[Value], now: float) -> None:
        """A TPDO, by its place in the plan, with the numbers of its objects."""

    def object_read(self, index: int, subindex: int, value: Value, now: float) -> None:
        """An object was read by SDO."""

    def object_unread(self, index: int, subindex: int, reason: str, now: float) -> None:
        """It could not be read."""

    def object_written(self, index: int, subindex: int, now: float) -> None:
        """The device took a value."""

    def object_unwritten(self, index: int, subindex: int, reason: str, now: float) -> None:
        """A value was not taken by the device."""

    def emergency_received(self, message: EmergencyMessage, now: float) -> None:
        """An EMCY message."""

    def boot_failed(self, letter: BootError, detail: str, now: float) -> None:
        """A boot has ended with a letter."""


@dataclass(slots=True, eq=False)
class _Poll:
    reading: ObjectReading
    due: float = math.inf
    carrier: int | None = None
    """The TPDO that carries the object too."""


@dataclass(slots=True, eq=False)
class _Outgoing:
    pdo: ManagedPdo
    content: PdoContent
    values: list[Value]
    due: float = math.inf
    sent: float = -math.inf


class ManagedNode:
    """A device, from its boot to its loss and back. `ready(node, now)` is called when it may be started."""

    def __init__(
        self, plan: NodePlan, send: Send, observer: NodeObserver, ready: Callable[[ManagedNode, float], None]
    ) -> None:
        """ValueError for PDOs that no frame can carry."""
        self.plan = plan
        self.counters = ManagedCounters()
        self.identity: dict[int, int] = {}
        """What 1018h has said by sub-index; 0 stands for 1000h."""
        self.nmt: NmtState | None = None
        """Its state as its heartbeat says; None while nobody knows."""
        self.last_emergency: EmergencyMessage | None = None
        self.channel = SdoChannel(plan.node, send, plan.sdo_timeout)
        self.boot = Boot(plan, self)
        self._send = send
        self._observer = observer
        self._ready = ready
        self._watch, self._watch_due, self._spared = Watch.WAITING, math.inf, False
        self._alive_due = self._drift_due = math.inf
        self._received = [0] * len(plan.pdos)
        self._contents = [PdoContent(pdo.objects) for pdo in plan.pdos]
        self._outgoing = {
            place: _Outgoing(pdo, self._contents[place], [0] * len(pdo.objects))
            for place, pdo in enumerate(plan.pdos)
            if not pdo.transmit
        }
        carriers = {
            (item.index, item.subindex): place
            for place, pdo in enumerate(plan.pdos)
            if pdo.transmit
            for item in pdo.objects
        }
        self._polls = [
            _Poll(item, carrier=carriers.get((item.index, item.subindex))) for item in plan.readings
        ]

    # -- how it is -----------------------------------------------------------------------------------------------

    @property
    def running(self) -> bool:
        """Whether it is in operation, as far as is known."""
        return self.boot.step is BootStep.RUNNING

    @property
    def condition(self) -> NodeCondition:
        """How it is, in one word."""
        step, letter = self.boot.step, self.boot.letter
        if step is BootStep.IDLE:
            return NodeCondition.OFFLINE
        if step is BootStep.RUNNING:
            return NodeCondition.OPERATIONAL
        if step is BootStep.READY:
            return NodeCondition.READY
        if letter in (BootError.NO_ANSWER, BootError.HEARTBEAT):
            return NodeCondition.ABSENT
        return NodeCondition.FAILED if letter is not None and letter.is_failure else NodeCondition.BOOTING

    @property
    def problem(self) -> str:
        """Why it is not in operation: `D another vendor (1018h:01: is ... instead of ...)`; empty if it is."""
        letter = self.boot.letter
        if self.running or letter is None or not letter.is_failure:
            return ""
        return f"{letter.value} {letter.words}" + (f" ({self.boot.detail})" if self.boot.detail else "")

    # -- the bus -------------------------------------------------------------------------------------------------

    def begin(self, now: float) -> None:
        """The bus carries frames: boot the device."""
        self.boot.begin(now, fresh=False)

    def stop(self, reason: str, now: float) -> None:
        """The bus carries none, or the device is given up."""
        self._leave(reason, now)
        self.boot.stop()
        self.nmt = None

    def handlers(self) -> Iterable[tuple[int, Callable[[Frame, float], None]]]:
        """The identifiers that it sends with, and what takes its frames."""
        node = self.plan.node
        yield Function.ERROR_CONTROL + node, self._receive_error_control
        yield Function.EMCY + node, self._receive_emergency
        yield Function.SDO_RESPONSE + node, self.channel.receive
        for place, pdo in enumerate(self.plan.pdos):
            if pdo.transmit:
                yield pdo.cob_id, partial(self._receive_pdo, place)

    def gap(self, since: float, now: float) -> None:
        """The process stood still and heard nothing: what the device may have said meanwhile is read first."""
        time = now - since
        self.channel.spare(time)
        self.boot.spare(time)
        self._drift_due += time
        if self._watch_due < math.inf:
            self._watch_due = spared(self._watch_due, self.plan.heartbeat, since, now, again=self._spared)
            self._spared = True

    def tick(self, now: float) -> None:
        """What time leads to."""
        self.channel.tick(now)
        self.boot.tick(now)
        if now >= self._watch_due:
            self._missed(now)
        if now >= self._drift_due:
            self._drift_due = math.inf
            self._restart("has left operation by itself", now)
        if now >= self._alive_due:
            self._alive_due = math.inf
            if not self.channel.put(SdoJob(0x1000, 0, None, self._alive), now):
                self._alive_due = now + self.plan.alive
        for poll in self._polls:
            if now >= poll.due:
                self._read(poll, now)
        for outgoing in self._outgoing.values():
            if now >= outgoing.due:
                self._transmit(outgoing, now)

    def next_deadline(self) -> float:
        """When `tick` has something to do."""
        due = min(
            self.channel.next_deadline(),
            self.boot.next_deadline(),
            self._watch_due,
            self._alive_due,
            self._drift_due,
        )
        for poll in self._polls:
            due = min(due, poll.due)
        for outgoing in self._outgoing.values():
            due = min(due, outgoing.due)
        return due

    def renew(self, can_id: int) -> Frame | None:
        """The RPDO with this identifier as it would be sent now; None if there is none."""
        if self.running:
            for outgoing in self._outgoing.values():
                if outgoing.pdo.cob_id == can_id:
                    return Frame(can_id, outgoing.content.pack(outgoing.values))
        return None

    # -- what its user does --------------------------------------------------------------------------------------

    def start(self, now: float, *, commanded: bool = False) -> None:
        """Put it into operation. `commanded`: all devices were sent the command at once."""
        if not self.boot.is_kept and not commanded:
            self.command(NmtCommand.START, now)
        self.boot.started()
        self.counters.boots += 1
        self.nmt = NmtState.OPERATIONAL
        if not self.plan.heartbeat:
            self._alive_due = now + self.plan.alive
        for poll in self._polls:
            poll.due = now
        for outgoing in self._outgoing.values():
            outgoing.due = now + outgoing.pdo.repeat if outgoing.pdo.repeat else math.inf
        self._observer.node_started(now)

    def write_pdo(self, place: int, item: int, value: Value, now: float) -> None:
        """Give an object of an RPDO another value; the PDO goes out with it. Nothing happens out of operation."""
        if not self.running:
            return
        outgoing = self._outgoing[place]
        outgoing.values[item] = value
        outgoing.due = min(outgoing.due, max(now, outgoing.sent + outgoing.pdo.spacing))

    def flush(self, now: float) -> None:
        """Send the RPDOs that were written and may go out now."""
        for outgoing in self._outgoing.values():
            if now >= outgoing.due:
                self._transmit(outgoing, now)

    def write_object(self, index: int, subindex: int, data: bytes, now: float) -> None:
        """Write an object by SDO; of several values that wait the newest goes out. Nothing happens out of operation."""
        if self.running and not self.channel.put(SdoJob(index, subindex, data, self._written), now):
            self._observer.object_unwritten(index, subindex, "too much waits for the device already", now)

    # -- what its boot does --------------------------------------------------------------------------------------

    def ask(self, index: int, subindex: int, data: bytes | None, done: Done, now: float) -> None:
        """Read an object, or write it, when it is its turn."""
        self.channel.put(SdoJob(index, subindex, data, done), now)

    def forget(self) -> None:
        """Drop all transfers that are not done."""
        self.channel.forget()

    def command(self, command: NmtCommand, now: float) -> None:
        """Send it an NMT command."""
        self._send(Frame(Function.NMT, bytes((command, self.plan.node))), Priority.ORDERED)

    def identified(self, subindex: int, number: int) -> None:
        """1018h has said so."""
        self.identity[subindex] = number

    def output(self, index: int, subindex: int, data: bytes) -> None:
        """What an object of an RPDO holds."""
        for outgoing in self._outgoing.values():
            for place, item in enumerate(outgoing.pdo.objects):
                if (item.index, item.subindex) == (index, subindex):
                    single = PdoContent((item,))
                    outgoing.values[place] = single.unpack(data)[0]

    def ready(self, now: float) -> None:
        """It may be started."""
        self._ready(self, now)

    def failed(self, now: float) -> None:
        """The boot has ended with a letter."""
        assert self.boot.letter is not None
        self._observer.boot_failed(self.boot.letter, self.boot.detail, now)

    # -- what it says --------------------------------------------------------------------------------------------

    def _receive_error_control(self, frame: Frame, now: float) -> None:
        if frame.remote or len(frame.data) != 1:
            return
        state = frame.data[0]
        if state == NmtState.INITIALISING:
            self.counters.boot_ups += 1
            self._see(Seen.BOOT_UP, now)
            self._leave("the device has booted", now)
            self.boot.boot_up(now)
        elif state in (NmtState.STOPPED, NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL):
            self.nmt = NmtState(state)
            self._see(Seen.HEARTBEAT, now)
            self.boot.heartbeat(state, now)
            self._compare_state(now)
            if self.running and self.nmt is NmtState.OPERATIONAL:
                self._observer.node_seen(now)

    def _compare_state(self, now: float) -> None:
        """A device that was started and says otherwise for long is none that works."""
        if not self.running or self.nmt is NmtState.OPERATIONAL:
            self._drift_due = math.inf
        else:
            self._drift_due = min(self._drift_due, now + max(DRIFT, self.plan.heartbeat))

    def _see(self, seen: Seen, now: float) -> None:
        self._watch = WATCH.get((self._watch, seen), self._watch)
        watched = self.plan.heartbeat > 0 and self._watch is Watch.ALIVE
        self._watch_due = now + self.plan.heartbeat if watched else math.inf
        self._spared = False

    def _missed(self, now: float) -> None:
        self._see(Seen.TIMEOUT, now)
        self.nmt = None
        self.counters.heartbeat_misses += 1
        if self.boot.step in (BootStep.READY, BootStep.RUNNING):
            self._leave("heartbeat lost", now)
            self.boot.fail(BootError.HEARTBEAT, f"silent for {self.plan.heartbeat:g} s", now)

    def _alive(self, result: SdoResult, now: float) -> None:
        if result.silent:
            self._leave("no answer", now)
            self.boot.fail(BootError.NO_ANSWER, "read 1000h:00: no answer", now)
        else:
            self._alive_due = now + self.plan.alive
            self._observer.node_seen(now)

    def _receive_emergency(self, frame: Frame, now: float) -> None:
        message = None if frame.remote else read_emergency(frame.data)
        if message is not None:
            self.counters.emergencies += 1
            self.last_emergency = message
            self._observer.emergency_received(message, now)

    def _receive_pdo(self, place: int, frame: Frame, now: float) -> None:
        if frame.remote or not self.running:
            return
        content = self._contents[place]
        if len(frame.data) < content.size:
            self.counters.pdos_short += 1
            return
        self.counters.pdos_received += 1
        self._received[place] += 1
        self._observer.pdo_received(place, content.unpack(frame.data[: content.size]), now)

    # -- inside --------------------------------------------------------------------------------------------------

    def _leave(self, reason: str, now: float) -> None:
        """Stop to exchange values with it."""
        self._alive_due = self._drift_due = math.inf
        for poll in self._polls:
            poll.due = math.inf
        for outgoing in self._outgoing.values():
            outgoing.due = math.inf
        if self.running:
            self.channel.forget()
            self._observer.node_ended(reason, now)

    def _restart(self, reason: str, now: float) -> None:
        self._leave(reason, now)
        self.boot.begin(now, fresh=False)

    def _read(self, poll: _Poll, now: float) -> None:
        poll.due = math.inf
        reading = poll.reading
        before = self._received[poll.carrier] if poll.carrier is not None else 0

        asked = now

        def done(result: SdoResult, now: float) -> None:
            if reading.period:
                poll.due = max(now, asked + reading.period)
            if poll.carrier is None or self._received[poll.carrier] == before:
                self._hand_over(reading, result, now)

        if not self.channel.put(SdoJob(reading.index, reading.subindex, None, done), now):
            poll.due = now + max(reading.period, FULL)

    def _hand_over(self, reading: ObjectReading, result: SdoResult, now: float) -> None:
        """A value that a PDO has brought since it was asked for is newer than the answer: it is not handed over."""
        problem = reason_of(result)
        value = None if problem else _number(result.data, reading.type)
        if value is not None:
            self._observer.object_read(reading.index, reading.subindex, value, now)
        else:
            problem = (
                problem or f"length {len(result.data)}, where {reading.type.name} has {reading.type.size}"
            )
            self._observer.object_unread(reading.index, reading.subindex, problem, now)

    def _written(self, result: SdoResult, now: float) -> None:
        if result.good:
            self._observer.object_written(result.index, result.subindex, now)
        else:
            self._observer.object_unwritten(result.index, result.subindex, reason_of(result), now)

    def _transmit(self, outgoing: _Outgoing, now: float) -> None:
        pdo = outgoing.pdo
        outgoing.sent = now
        outgoing.due = now + pdo.repeat if pdo.repeat else math.inf
        if self._send(Frame(pdo.cob_id, outgoing.content.pack(outgoing.values)), Priority.NEWEST):
            self.counters.pdos_sent += 1


def _number(data: bytes, kind: CanType) -> Value | None:
    """The value of an upload. An expedited answer that does not say how many of its bytes count has four."""
    size = kind.size
    if size is None or len(data) < size or (len(data) > size and len(data) != 4):
        return None
    return kind.unpack(data[:size])
