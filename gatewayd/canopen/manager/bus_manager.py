"""The manager of one bus: its devices, its own heartbeat and SYNC, and when devices are started. Pure.

No device is started while a mandatory one is missing; from then on each is started when it has booted. One command for
all is sent only where every device is ready for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.heartbeat import HeartbeatProducer
from gatewayd.canopen.manager.boot_steps import BootStep
from gatewayd.canopen.manager.node import ManagedNode, NodeObserver
from gatewayd.canopen.manager.plan import ManagerPlan, NodePlan
from gatewayd.canopen.nmt import UNCONFIGURED, NmtCommand, NmtSlave, NmtState
from gatewayd.canopen.sync import SyncService

ALL_NODES: Final = 0
"""Target of an NMT command that every node obeys."""


class ManagerError(Exception):
    """A device cannot be managed beside the others; the text says why."""


class BusManager:
    """The devices of one bus. `alive(now)` says whether the core lives: without it there is no heartbeat."""

    def __init__(
        self, plan: ManagerPlan, send: Send, alive: Callable[[float], bool], changed: Callable[[], None]
    ) -> None:
        """`changed()` is called when other identifiers are listened to."""
        self.plan = plan
        self.nodes: dict[int, ManagedNode] = {}
        """By node-ID."""
        self.bus = BusState.ABSENT
        self._send = send
        self._changed = changed
        self._released = False
        self._handlers: dict[int, Callable[[Frame, float], None]] = {}
        # The manager obeys no NMT command, so this node only has a state to report.
        self._own = NmtSlave(
            send,
            lambda: plan.node if plan.node is not None else UNCONFIGURED,
            lambda _old, _new, _now: None,
            lambda _command, _now: None,
        )
        self._heartbeat = HeartbeatProducer(
            send, self._own, alive, plan.heartbeat if plan.node is not None else 0
        )
        self._sync = SyncService(
            send,
            plan.sync,
            allowed=lambda: self.bus.carries,
            on_sync=lambda _counter, _now: None,
            wrong_length=lambda _length, _now: None,
            changed=lambda: None,
        )

    # -- devices -------------------------------------------------------------------------------------------------

    @property
    def missing(self) -> tuple[int, ...]:
        """Mandatory devices that are not ready, by node-ID."""
        return tuple(
            number
            for number, node in sorted(self.nodes.items())
            if node.plan.mandatory and node.boot.step not in (BootStep.READY, BootStep.RUNNING)
        )

    @property
    def released(self) -> bool:
        """Whether devices are started: every mandatory one was ready once since the bus came up."""
        return self._released

    def attach(self, plan: NodePlan, observer: NodeObserver, now: float) -> ManagedNode:
        """Take a device into care, and boot it if the bus carries frames. ManagerError if it clashes with another."""
        if plan.node in self.nodes or plan.node == self.plan.node:
            raise ManagerError(f"node {plan.node} is managed already")
        node = ManagedNode(plan, self._send, observer, self._node_ready)
        handlers = dict(node.handlers())
        clash = sorted(handlers.keys() & (self._handlers.keys() | {Function.NMT, self.plan.sync.cob_id}))
        if clash:
            raise ManagerError(f"node {plan.node} sends with {clash[0]:03X}h, which is taken")
        self.nodes[plan.node] = node
        self._handlers |= handlers
        self._changed()
        if self.bus.carries:
            node.begin(now)
        return node

    def detach(self, number: int, reason: str, now: float) -> None:
        """Give a device up; it is left as it is."""
        node = self.nodes.pop(number)
        node.stop(reason, now)
        for can_id, _ in node.handlers():
            del self._handlers[can_id]
        self._changed()
        self._start_those_ready(now)

    def can_ids(self) -> frozenset[int]:
        """The identifiers that are listened to."""
        return frozenset(self._handlers)

    # -- the bus -------------------------------------------------------------------------------------------------

    def bus_changed(self, state: BusState, now: float) -> None:
        """The bus carries frames, or carries none any more."""
        carried, self.bus = self.bus.carries, state
        if state.carries == carried:
            return
        self._released = False
        if state.carries:
            self._own.resume(NmtState.INITIALISING, now)
            self._own.boot(now)
            self._own.resume(NmtState.OPERATIONAL, now)
            self._heartbeat.restart(now)
            self._sync.restart(now)
        for node in list(self.nodes.values()):
            if state.carries:
                node.begin(now)
            else:
                node.stop("the CAN bus is away", now)

    def receive(self, frame: Frame, now: float) -> None:
        """A frame of the bus."""
        handler = self._handlers.get(frame.can_id)
        if handler is not None and self.bus.carries:
            handler(frame, now)

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`."""
        for node in self.nodes.values():
            node.gap(since, now)

    def tick(self, now: float) -> None:
        """What time leads to."""
        if not self.bus.carries:
            return
        self._heartbeat.tick(now)
        self._sync.tick(now)
        for node in list(self.nodes.values()):
            node.tick(now)

    def next_deadline(self) -> float:
        """When `tick` has something to do."""
        if not self.bus.carries:
            return float("inf")
        due = min(self._heartbeat.next_deadline(0.0), self._sync.next_deadline(0.0))
        return min([due, *(node.next_deadline() for node in self.nodes.values())])

    def renew(self, can_id: int, now: float) -> Frame | None:
        """The cyclic frame that would be sent with this identifier now; None if there is none."""
        if self.plan.node is not None and can_id == Function.ERROR_CONTROL + self.plan.node:
            return self._heartbeat.frame(now)
        return next((frame for node in self.nodes.values() if (frame := node.renew(can_id))), None)

    # -- starting ------------------------------------------------------------------------------------------------

    def _node_ready(self, node: ManagedNode, now: float) -> None:
        if self._released:
            node.start(now)
        else:
            self._start_those_ready(now)

    def _start_those_ready(self, now: float) -> None:
        ready = [node for node in self.nodes.values() if node.boot.step is BootStep.READY]
        if self.missing or not ready:
            return
        self._released = True
        at_once = self.plan.start_all and len(ready) == len(self.nodes)
        if at_once:
            self._send(Frame(Function.NMT, bytes((NmtCommand.START, ALL_NODES))), Priority.ORDERED)
        for node in ready:
            node.start(now, commanded=at_once)
