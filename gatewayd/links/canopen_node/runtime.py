"""The CANopen link: one node, its bus, and the loop's clock.

Frames go from the driver into the node and out again within one turn of the loop; one timer follows the node's next
deadline. The heartbeat needs the core: a daemon that is frozen, or whose core stands still, falls silent.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import datetime

from gatewayd.canopen.bus import BusError, BusState
from gatewayd.canopen.drivers import make_bus
from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.lss import BIT_RATES
from gatewayd.canopen.nmt import NmtState
from gatewayd.canopen.queue import Transmitter
from gatewayd.canopen.supervised import SupervisedBus
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.core.requester import Requester
from gatewayd.links.can_frames import packed
from gatewayd.links.canopen_node.health import health_of, other_bit_rate
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.observer import Observer
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.store import BackgroundStore, Store
from gatewayd.links.contract import Context, Link, LinkHealth, LinkRuntime, Passage, Tap
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.progress import wait_with_progress
from gatewayd.loop.retry import until_done
from gatewayd.mapping.plan import LinkPlan

CORE_TIME = 0.5
"""Seconds without a count of the core's heartbeat after which the core counts as stuck."""
RETRY = 2.0
"""Seconds between two attempts at a bus that cannot be used as it is set up."""
LOSS_INTERVAL = 10.0
"""Seconds between two lines of the log about lost frames."""
CLOCK_STEP = 1.0
"""Seconds by which the network's time may differ from what was last reported before it is reported again."""

log = logging.getLogger("gatewayd.canopen")


class CanLink(Link, Observer):
    """Keeps `cell` on its CAN bus while `run` runs."""

    title = "CAN link"
    plan: CanopenPlan

    def __init__(self, plan: CanopenPlan, cell: Cell, store: Store) -> None:
        self.plan = plan
        self._cell = cell
        self._bus: SupervisedBus | None = None
        self._tap: Tap | None = None
        self._transmitter = Transmitter(
            self._offer,
            lambda can_id: self.node.renew(can_id, clock.now()),
            now=clock.now,
            punctual=self._offer_at_once,
            overdue=clock.overdue,
        )
        self._timer: asyncio.TimerHandle | None = None
        self._catching: asyncio.Handle | None = None
        self._inputs_changed: asyncio.Handle | None = None
        self._receives = self._wrote = False  # frames are being received; one of them has written an input
        self._due = math.inf
        self._runs = False
        self._started = False
        self._beat = (-1, -math.inf)
        self._offset = math.inf
        self._lost = 0
        self._lost_reported = -math.inf
        self._other_bit_rate: int | None = None
        self._unusable = ""
        """Why the bus cannot be used as it is set up, until it can."""
        self._switch = (0, 0.0)
        self._switching = asyncio.Event()
        self._progress = 0
        # The kernel's interfaces are set up by the administrator; python-can opens its own with a bit rate.
        self._bit_rates = (
            () if plan.interface == "socketcan" else tuple(rate for rate in BIT_RATES if rate is not None)
        )
        self._store = store
        self.node = self._new_node()
        cell.listeners.append(self._on_image)
        self._show_words()

    @property
    def progress(self) -> int:
        """Counts while the link's task goes on, whatever the bus does."""
        return self._progress

    @property
    def reachable(self) -> bool:
        """While the bus carries frames."""
        return self.node.bus.carries

    def health(self) -> LinkHealth:
        """How the bus is, and what the node on it is up to."""
        return health_of(self.node, self.plan, self.reason)

    @property
    def reason(self) -> str:
        """Why the bus is not as it should be, in words with a remedy; empty where all is well."""
        if self._unusable:
            return self._unusable
        if self.node.bus is not BusState.ACTIVE:
            return self._bus.reason if self._bus is not None else ""
        return other_bit_rate(self.plan, self._other_bit_rate)

    async def run(self) -> None:
        """Stay on the bus until cancelled. May be run again: for the node the bus was away meanwhile."""
        self._runs = True
        try:
            await self._open(self.node.bit_rate)
            now = clock.now()
            if not self._started:
                self._started = True
                self.node.start(now)
            self._schedule(now)
            while True:
                await self._wait_until(math.inf)
                self._switching.clear()
                bit_rate, silence = self._switch
                await self._wait_until(clock.now() + silence)
                await self._open(bit_rate)
        finally:
            self._leave()

    def departing(self, plan: LinkPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """Where another node takes the place of this one, all that write by it; the same node keeps its writers."""
        return (
            {}
            if plan is not None
            else dict.fromkeys(self.node.writers(), "its CANopen node restarts or ends")
        )

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """Another node takes the place of this one: who wrote by it is lost."""
        if plan is None:
            self.node.lose_writers("the new mapping needs another node", now)

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on, unnoticed by the bus, with the cell that succeeded the present one."""
        assert isinstance(plan, CanopenPlan)
        former = self.node
        self.plan, self._cell = plan, cell
        self.node = self._new_node()
        if self._started:
            self.node.resume(former, now)
        cell.listeners.append(self._on_image)
        self._show_words()
        self.cob_ids_changed()
        if self._runs:
            self._schedule(now)

    async def close(self) -> None:
        """Send what still waits, as far as the bus takes it."""
        self._transmitter.flush()

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: frames that are read now may have waited that long.

        They are read before the loop serves anything else; what waits to be sent is made anew.
        """
        self.node.gap(since, now)
        self._beat = (self._beat[0], now)
        self._transmitter.renew()
        if not self._runs:
            self.node.caught_up()
        elif self._catching is None:
            self._catching = asyncio.get_running_loop().call_soon(self._catch_up)

    # -- called by the driver ------------------------------------------------------------------------------------

    def on_frames(self, frames: list[Frame], now: float) -> None:
        """Received frames."""
        if self._tap is not None:
            self._pass(self._tap, frames, now, outgoing=False)
        receive = self.node.receive
        self._receives = True
        try:
            for frame in frames:
                receive(frame, now)
        finally:
            self._receives = False
        if self._wrote:
            self._wrote = False
            self.node.image_changed(Direction.INPUT, now)
        self._schedule(now)

    def on_error(self, error: ErrorFrame, now: float) -> None:
        """An error frame; what follows from it comes as a state."""

    def on_lost(self, count: int, now: float) -> None:
        """Frames were lost for want of room."""
        self._lost += count
        if now - self._lost_reported >= LOSS_INTERVAL:
            log.warning("CAN frames lost", extra=fields(**self._names(), frames=self._lost))
            self._lost, self._lost_reported = 0, now
        self.node.frames_lost(count, now)
        self._schedule(now)

    def on_state(self, state: BusState, reason: str, now: float) -> None:
        """The bus is in another state."""
        level = logging.INFO if state is BusState.ACTIVE or not self._runs else logging.WARNING
        log.log(
            level,
            "CAN bus %s",
            state.name.lower().replace("_", "-"),
            extra=fields(**self._names(), reason=reason),
        )
        self._cell.health.words["can_bus"] = state + 1
        if state.carries:
            self._compare_bit_rates()
            self._transmitter.open()
        else:
            self._transmitter.close()
        self.node.bus_changed(state, now)
        self._schedule(now)

    def on_writable(self, now: float) -> None:
        """There is room in the driver again."""
        self._transmitter.flush()

    # -- called by the node --------------------------------------------------------------------------------------

    def cob_ids_changed(self) -> None:
        """The node listens to other COB-IDs now."""
        if self._bus is not None:
            self._bus.set_filters(self.node.cob_ids(), self.node.remote_ids())

    def deadline_changed(self) -> None:
        """What the node waited for is there."""
        self._schedule(clock.now())

    def nmt_changed(self, old: NmtState, new: NmtState, now: float) -> None:
        """The node is in another NMT state."""
        self._cell.health.words["nmt_state"] = new
        log.info("CANopen node %s", new.name.lower().replace("_", "-"), extra=fields(**self._names()))

    def report(self, text: str) -> None:
        """Something for the log."""
        log.warning("CANopen: %s", text, extra=fields(**self._names()))

    def time_received(self, moment: datetime, now: float) -> None:
        """The network's clock: reported once, and when it was set."""
        offset = moment.timestamp() - now
        if abs(offset - self._offset) > CLOCK_STEP:
            self._offset = offset
            log.info(
                "network time",
                extra=fields(**self._names(), bus_time=moment.isoformat(timespec="milliseconds")),
            )

    def switch_bit_rate(self, bit_rate: int, delay: float, now: float) -> None:
        """An LSS master activates a bit rate: be silent, switch, be silent for as long again (CiA 305)."""
        if self.plan.interface == "socketcan":
            return
        self._close_bus("LSS switches the bit rate")
        self._switch = (bit_rate, 2 * delay)
        self._switching.set()

    # -- inside --------------------------------------------------------------------------------------------------

    def _show_words(self) -> None:
        self._cell.health.words.update(can_bus=self.node.bus + 1, nmt_state=self.node.nmt.state)

    def _new_node(self) -> Node:
        return Node(
            self.plan,
            self._cell,
            self._transmitter.send,
            self._store,
            self._core_lives,
            observer=self,
            bit_rates=self._bit_rates,
        )

    def _count(self) -> None:
        self._progress += 1

    async def _wait_until(self, moment: float) -> None:
        """Wait for that moment, or for a switch of the bit rate, and count meanwhile."""
        rest = moment - clock.now()
        # Not wait_for: Python 3.11's can swallow a cancellation that comes with the time-out.
        with suppress(TimeoutError):
            async with asyncio.timeout(None if rest == math.inf else rest):
                await wait_with_progress(self._switching.wait(), self._count, math.inf)

    async def _open(self, bit_rate: int) -> None:
        """Open the bus; a set-up that cannot work is tried again, in case it is repaired."""

        async def attempt() -> None:
            bus = self._bus = make_bus(self.plan.interface, self.plan.channel, bit_rate, self)
            bus.set_filters(self.node.cob_ids(), self.node.remote_ids())
            try:
                await wait_with_progress(bus.open(), self._count, math.inf)
            except BusError:
                self._bus = None
                raise

        def report(error: Exception) -> None:
            self._unusable = str(error)
            log.error("%s", error, extra=fields(**self._names(), retry_s=RETRY))

        await until_done(attempt, BusError, report, RETRY, self._count)
        self._unusable = ""
        if self._bus is not None and not self._bus.state.carries and self._bus.reason:
            self.on_state(self._bus.state, self._bus.reason, clock.now())

    def _compare_bit_rates(self) -> None:
        """The kernel's interface is what it is; `check` has computed the load with what the mapping says."""
        actual = self._bus.bitrate if self._bus is not None else None
        if actual not in (None, self.plan.bitrate, self._other_bit_rate):
            log.warning(
                "CAN bit rate is not that of the mapping",
                extra=fields(**self._names(), bitrate=actual, mapping=self.plan.bitrate),
            )
        self._other_bit_rate = actual

    def _offer(self, frame: Frame) -> bool:
        return self._bus is not None and self._give(self._bus, frame)

    def _give(self, bus: SupervisedBus, frame: Frame) -> bool:
        taken = bus.send(frame)
        if taken and self._tap is not None:
            self._pass(self._tap, (frame,), clock.now(), outgoing=True)
        return taken

    def trace(self, tap: Tap | None) -> None:
        """The frames that the node receives and sends; what it does not listen to does not reach it."""
        self._tap = tap

    def _pass(self, tap: Tap, frames: Iterable[Frame], now: float, *, outgoing: bool) -> None:
        for frame in frames:
            tap(Passage(now, packed(frame), outgoing, own=self.plan.channel))

    @property
    def _is_catching_up(self) -> bool:
        return self._catching is not None

    def _catch_up(self) -> None:
        """Read what waited; as long as there is more, what comes has waited too."""
        self._catching = None
        exhausted = self._bus is None or self._bus.catch_up()
        if self._is_catching_up:
            return  # The process was stopped again meanwhile: what is read by the next call has waited too.
        if exhausted:
            self.node.caught_up()
        elif self._runs:
            self._catching = asyncio.get_running_loop().call_soon(self._catch_up)
        self._transmitter.flush()
        if self._runs:
            self._schedule(clock.now())

    def _offer_at_once(self, frame: Frame) -> bool:
        """A frame that may not be late: not where older ones still wait in the kernel."""
        bus = self._bus
        return bus is not None and not bus.lags(self.node.bit_rate) and self._give(bus, frame)

    def _close_bus(self, reason: str) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.close()
            self.on_state(BusState.DOWN, reason, clock.now())

    def _leave(self) -> None:
        self._runs = False
        self._close_bus("the link ends")
        if self._timer is not None:
            self._timer.cancel()
        if self._catching is not None:
            self._catching.cancel()
            self.node.caught_up()
        if self._inputs_changed is not None:
            self._inputs_changed.cancel()
        self._timer, self._catching, self._inputs_changed, self._due = None, None, None, math.inf
        self._switching.clear()

    def _on_image(self, direction: Direction) -> None:
        """The cell has changed. Of inputs the node hears once in a turn of the loop, or for frames that came together.

        Of outputs at once: packages may come together, and a pulse of one of them must not be lost.
        """
        if direction is Direction.OUTPUT or not self._runs:
            self._look_at_image(direction)
        elif self._receives:
            self._wrote = True
        elif self._inputs_changed is None:
            self._inputs_changed = asyncio.get_running_loop().call_soon(self._look_at_inputs)

    def _look_at_inputs(self) -> None:
        self._inputs_changed = None
        self._look_at_image(Direction.INPUT)

    def _look_at_image(self, direction: Direction) -> None:
        now = clock.now()
        self.node.image_changed(direction, now)
        self._schedule(now)

    def _schedule(self, now: float) -> None:
        """Move the timer if the node's next deadline has come nearer."""
        due = self.node.next_deadline(now)
        if due >= self._due or not self._runs:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = asyncio.get_running_loop().call_at(due, self._tick)

    def _tick(self) -> None:
        now = clock.judged_now()
        self._timer, self._due = None, math.inf
        self.node.tick(now)
        self._schedule(now)

    def _core_lives(self, now: float) -> bool:
        count, since = self._beat
        if self._cell.health.heartbeat != count:
            self._beat = (self._cell.health.heartbeat, now)
            return True
        return now - since <= CORE_TIME

    def _names(self) -> dict[str, object]:
        return {
            "cell": self._cell.definition.name,
            "bus": f"{self.plan.interface}:{self.plan.channel}",
            "node": self.plan.node,
        }


class CanopenRuntime(LinkRuntime):
    """Nodes, each with a file of what its master had it store."""

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> CanLink:
        """A node, which boots when its link runs."""
        assert isinstance(plan, CanopenPlan)
        return CanLink(plan, cell, BackgroundStore(context.state / f"{cell.definition.name}.canopen.json"))


RUNTIME = CanopenRuntime()
"""What the daemon needs of this kind of link."""
