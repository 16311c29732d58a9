"""The manager at work: one bus with its driver, the loop's clock, and a timer for the next deadline.

Its heartbeat is sent by this process and not by the kernel: a process that is frozen falls silent, and devices that
watch it can fall back.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from gatewayd.canopen.bus import BusError, BusState
from gatewayd.canopen.drivers import make_bus
from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.manager.bus_manager import BusManager
from gatewayd.canopen.manager.node import ManagedNode, NodeObserver
from gatewayd.canopen.manager.plan import ManagerPlan, NodePlan
from gatewayd.canopen.queue import Transmitter
from gatewayd.canopen.supervised import SupervisedBus
from gatewayd.loop import clock
from gatewayd.loop.progress import wait_with_progress
from gatewayd.loop.retry import until_done

FrameTap = Callable[[Frame, bool], None]
REOPEN = 2.0
"""Seconds between two attempts at a bus that cannot be used as it is set up."""


class Manager:
    """Manages the devices of one bus while `run` runs; they may come and go meanwhile."""

    def __init__(
        self,
        plan: ManagerPlan,
        *,
        alive: Callable[[float], bool] = lambda _now: True,
        report: Callable[[str], None] = lambda _text: None,
    ) -> None:
        """`alive(now)`: whether the core lives, without which there is no heartbeat; `report` takes lines of a log."""
        self.plan = plan
        self.lost_frames = 0
        """Received frames that found no room."""
        self.reason = ""
        """Why the bus carries no frames, in words; empty while it does."""
        self.progress = 0
        """Counts while `run` goes on, whatever the bus does."""
        self.tap: FrameTap | None = None
        """Takes every frame that is heard or sent, and whether it was sent, while somebody traces."""
        self._report = report
        self._bus: SupervisedBus | None = None
        self._transmitter = Transmitter(
            self._offer,
            lambda can_id: self.bus_manager.renew(can_id, clock.now()),
            now=clock.now,
            punctual=self._offer_at_once,
            overdue=clock.overdue,
        )
        self.bus_manager = BusManager(plan, self._transmitter.send, alive, self._set_filters)
        self._timer: asyncio.TimerHandle | None = None
        self._due = math.inf

    @property
    def nodes(self) -> dict[int, ManagedNode]:
        """Its devices by node-ID."""
        return self.bus_manager.nodes

    @property
    def bus(self) -> BusState:
        """How the bus is."""
        return self.bus_manager.bus

    def attach(self, plan: NodePlan, observer: NodeObserver) -> ManagedNode:
        """Take a device into care, at any time. ManagerError if it clashes with another."""
        now = clock.now()
        node = self.bus_manager.attach(plan, observer, now)
        self.schedule(now)
        return node

    def detach(self, number: int, reason: str) -> None:
        """Give a device up; it is left as it is."""
        now = clock.now()
        self.bus_manager.detach(number, reason, now)
        self.schedule(now)

    async def run(self) -> None:
        """Stay on the bus until cancelled. May be run again."""
        try:
            await until_done(self._open, BusError, self._unusable, REOPEN, self._count)
            await wait_with_progress(asyncio.Event().wait(), self._count, math.inf)
        finally:
            self._leave()

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: nobody is blamed for what could not be heard meanwhile."""
        self.bus_manager.gap(since, now)
        self._transmitter.renew()
        self._reschedule(now)

    def schedule(self, now: float) -> None:
        """Have the timer follow the next deadline, if that has come nearer: to be called after a write to a device."""
        due = self.bus_manager.next_deadline()
        if due >= self._due or self._bus is None:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = asyncio.get_running_loop().call_at(max(due, now), self._tick)

    # -- called by the driver ------------------------------------------------------------------------------------

    def on_frames(self, frames: list[Frame], now: float) -> None:
        """Received frames."""
        receive, tap = self.bus_manager.receive, self.tap
        for frame in frames:
            if tap is not None:
                tap(frame, False)
            receive(frame, now)
        self.schedule(now)

    def on_error(self, error: ErrorFrame, now: float) -> None:
        """An error frame; what follows from it comes as a state."""

    def on_lost(self, count: int, now: float) -> None:
        """Frames were lost for want of room."""
        self.lost_frames += count

    def on_state(self, state: BusState, reason: str, now: float) -> None:
        """The bus is in another state."""
        self.reason = "" if state is BusState.ACTIVE else reason
        self._report(f"CAN bus {state.name.lower().replace('_', '-')}" + (f": {reason}" if reason else ""))
        if state.carries:
            self._transmitter.open()
        self.bus_manager.bus_changed(state, now)
        if not state.carries:
            self._transmitter.close()
        self.schedule(now)

    def on_writable(self, now: float) -> None:
        """There is room in the driver again."""
        self._transmitter.flush()

    # -- inside --------------------------------------------------------------------------------------------------

    async def _open(self) -> None:
        plan = self.plan
        bus = self._bus = make_bus(plan.interface, plan.channel, plan.bitrate, self)
        bus.set_filters(self.bus_manager.can_ids())
        try:
            await bus.open()
        except BusError:
            self._bus = None
            raise
        if not bus.state.carries and bus.reason:
            self.on_state(bus.state, bus.reason, clock.now())

    def _unusable(self, error: Exception) -> None:
        self.reason = str(error)
        self._report(self.reason)

    def _count(self) -> None:
        self.progress += 1

    def _set_filters(self) -> None:
        if self._bus is not None:
            self._bus.set_filters(self.bus_manager.can_ids())

    def _offer(self, frame: Frame) -> bool:
        return self._bus is not None and self._give(self._bus, frame)

    def _offer_at_once(self, frame: Frame) -> bool:
        bus = self._bus
        return bus is not None and not bus.lags(self.plan.bitrate) and self._give(bus, frame)

    def _give(self, bus: SupervisedBus, frame: Frame) -> bool:
        taken = bus.send(frame)
        if taken and self.tap is not None:
            self.tap(frame, True)
        return taken

    def _reschedule(self, now: float) -> None:
        """Deadlines may have moved away as well."""
        self._due = math.inf
        self.schedule(now)

    def _tick(self) -> None:
        now = clock.judged_now()
        self._timer, self._due = None, math.inf
        self.bus_manager.tick(now)
        self.schedule(now)

    def _leave(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            self._transmitter.flush()
            bus.close()
            self.on_state(BusState.DOWN, "the manager ends", clock.now())
        if self._timer is not None:
            self._timer.cancel()
        self._timer, self._due = None, math.inf
