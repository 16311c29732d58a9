"""The robot link: one RTDE client and one cell.

Packages go into the image as they come. What the fieldbus writes goes out at once, then at most once per control cycle
of the controller, always as whole recipes, so that values of one request arrive in one package. Nothing is sent
before the controller's own inputs were adopted; from then on writes always are, by the recipes that were adopted last.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, FallbackKind, Value
from gatewayd.core.image import Quality
from gatewayd.links.contract import (
    Claim,
    Context,
    Level,
    LinkHealth,
    LinkRuntime,
    PackageTap,
    Passage,
    SourceLink,
    Tap,
)
from gatewayd.links.robot.availability import unavailable
from gatewayd.links.robot.claiming import claim_of
from gatewayd.links.robot.companions import Driven, all_inputs, all_outputs
from gatewayd.links.robot.controller import ControllerNotes
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.robot.inputs import ClaimedInputs
from gatewayd.links.robot.outputs import SessionOutputs
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.links.robot.readback import Package
from gatewayd.links.robot.recording import RecordedPackages
from gatewayd.links.robot.reports import ConnectionReports, report_kept, report_strange, report_text
from gatewayd.links.robot.watchdog import WatchdogFeed
from gatewayd.loop import clock
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address
from gatewayd.rtde.claims import ClaimStanding
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.loss import Loss, LossReason
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.session import ClientSettings, Session
from gatewayd.rtde.strange import StrangePackage

LAST_WORDS = 0.4
"""Seconds for which the end of the link waits until what is due has been sent."""
_LOOK = 0.005
_CYCLE_UNKNOWN = 0.002


class RobotLink(SourceLink):
    """Keeps `cell` and its controller in step while `run` runs."""

    title = "robot link"
    plan: RobotPlan

    def __init__(
        self, plan: RobotPlan, cell: Cell, former: RobotLink | None = None, *, on_request: bool = False
    ) -> None:
        """With a `former` link the counters go on; its `run` must have ended before this one's begins.

        `on_request`: inputs are claimed when `ask_claim` says so, and neither adopted nor written before.
        """
        self.plan = plan
        self._cell = cell
        self._on_request = on_request
        watchdog, variables = plan.watchdog, cell.definition.variables
        self._client = RtdeClient(
            ClientSettings(
                host=plan.host,
                port=plan.port,
                outputs=all_outputs(plan.outputs, variables),
                inputs=all_inputs(plan.inputs, variables),
                watchdog=watchdog.field if watchdog is not None else None,
                frequency=plan.frequency,
                read_back=plan.verify,
                claim_on_request=on_request,
            ),
            self,
        )
        self._driven = Driven()
        self._notes = ControllerNotes()
        if former is not None:
            self._client.statistics = former._client.statistics  # noqa: SLF001 - another one of the same class
            if not KIND.moved(former.plan, plan):
                self._driven, self._notes = former._driven, former._notes  # noqa: SLF001
        self._outputs = SessionOutputs()
        self._inputs = ClaimedInputs()
        self._session: Session | None = None
        """What was agreed and is not adopted yet."""
        self._agreed: Session | None = None
        """What the recipes in use are of: a newer session has registers that were not read yet."""
        self._adopting = False
        """Whether recipes and image are being taken over, so that they do not fit each other."""
        self._cycle = _CYCLE_UNKNOWN
        self._next_send = -math.inf
        self._pending: asyncio.TimerHandle | None = None
        self._stage: asyncio.TimerHandle | None = None
        self._watchdog = WatchdogFeed(self._client)
        self._connection = ConnectionReports()
        self._recorded = RecordedPackages(address(plan.host, plan.port))
        self.sent_listeners = []
        cell.listeners.append(self._on_change)

    def health(self) -> LinkHealth:
        """The session; how fresh what it brings is, the cell knows."""
        where = address(self.plan.host, self.plan.port)
        trouble = self._connection.trouble.removeprefix(f"{where}: ")
        statistics = self._client.statistics
        figures: dict[str, object] = {
            "address": where,
            "trouble": trouble,
            "watchdog": self._watchdog_fed(),
            "pauses": statistics.pauses,
            "overtaken": statistics.overtaken,
            "strange": {oddity.value: count for oddity, count in statistics.strange.by_oddity.items()},
            **self._notes.figures(self.plan, clock.now()),
        }
        if self._client.session is not None:
            problems = self._notes.problems(self.plan)
            level = Level.WARN if problems else Level.GOOD
            return LinkHealth("Robot", level, "connected", where, problems, figures)
        problems = (trouble,) if trouble else ()
        return LinkHealth("Robot", Level.BAD, "not connected", trouble or where, problems, figures)

    def _watchdog_fed(self) -> bool | None:
        return None if self.plan.watchdog is None else self._cell.health.watchdog_fed

    @property
    def progress(self) -> int:
        """Moves several times a second while `run` works, whatever the controller does."""
        return self._client.statistics.progress

    async def run(self) -> None:
        """Stay connected until cancelled. Raises what is a defect, after the robot was reported lost."""
        try:
            await self._run()
        except Exception:
            with suppress(Exception):
                self.session_lost(Loss(LossReason.FAILED, "internal error", started=True))
            raise

    async def _run(self) -> None:
        """Work; when cancelled, first let the fallbacks that have begun to act come to their end."""
        work = asyncio.create_task(self._work())
        try:
            await asyncio.shield(work)
        except asyncio.CancelledError:
            await self._finish()
            raise
        finally:
            self._cancel_timers()
            work.cancel()
            await asyncio.gather(work, return_exceptions=True)

    async def _work(self) -> None:
        watchdog = self.plan.watchdog
        if watchdog is None:
            await self._client.run()
            return
        async with asyncio.TaskGroup() as group:
            group.create_task(self._client.run())
            group.create_task(self._feed_watchdog(1 / watchdog.frequency))

    async def close(self) -> None:
        """Send what is still due. Cancelling `run` afterwards ends the connection; what was sent is delivered."""
        self._watchdog.ends = True
        end = clock.now() + LAST_WORDS
        while self._owed() and clock.now() < end:  # noqa: ASYNC110 - a session that is being set up may take it
            await asyncio.sleep(_LOOK)
        await self._finish()
        owed = self._owed()
        if owed:
            names = ", ".join(self._cell.definition.variables[index].name for index in owed)
            report_kept(self._cell.definition.name, names)

    async def _finish(self) -> None:
        """Send what is due, and wait for the control cycles that it needs."""
        end = clock.now() + LAST_WORDS
        self.flush(clock.now())
        while self._inputs.is_releasing and clock.now() < end:  # noqa: ASYNC110 - ends by a timer, or with the session
            await asyncio.sleep(_LOOK)

    def _owed(self) -> list[int]:
        """Inputs that should fall back and have not."""
        variables = self._cell.definition.variables
        return [
            index
            for index in sorted(self._cell.delivery.owed)
            if variables[index].on_release.kind is not FallbackKind.HOLD
        ]

    @property
    def claim(self) -> Claim:
        """How the claim of the inputs stands."""
        return claim_of(self._client.standing, adopted=self._cell.accepts_writes)

    def ask_claim(self) -> None:
        """Claim the inputs, if they are free. What the session reads of them is adopted with the next package."""
        self._client.claim()

    def withdraw_claim(self, why: str, now: float) -> None:
        """End the session, which is the only way to give inputs back; the next one claims nothing by itself."""
        self._client.reconnect(why)
        self._inputs = ClaimedInputs()
        self._session = self._agreed = None
        self._cancel_timers()
        self._cell.robot_lost(why, now)

    @property
    def _is_claimed(self) -> bool:
        """Whether inputs are ours as a whole: until then none is adopted, whatever the session has of them."""
        return not self._on_request or self._client.standing is ClaimStanding.HELD

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`. The packages that waited have their own time."""
        self._client.gap()

    def trace(self, tap: Tap | None) -> None:
        """What is said to the controller and by it."""
        if tap is None:
            self._client.trace(None)
            return
        peer = address(self.plan.host, self.plan.port)

        def passed(data: bytes, outgoing: bool, own: tuple[str, int] | None) -> None:
            tap(Passage(clock.now(), data, outgoing, peer, address(own[0], own[1]) if own else ""))

        self._client.trace(passed)

    def tap_packages(self, tap: PackageTap | None) -> None:
        """Every package that the client hands on, also those that come too late for the image."""
        self._recorded.hand_to(tap, self._client.session)

    def read_back(self, variable: int) -> Value | None:
        """What the controller's newest package says of an input, where the session reads it back."""
        return self._inputs.held(variable)

    def flush(self, now: float) -> None:
        """Send what is still due at once."""
        self._inputs.release(self._cell.delivery.take_releases())
        self._send(now)

    @property
    def settled(self) -> bool:
        """False between the claim of registers and the package that shows what they hold."""
        return self._session is None

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on with another plan and the successor of the cell, by the session that is there, at once.

        Inputs that are new take over what the controller was last given.
        """
        assert isinstance(plan, RobotPlan)
        self.flush(now)
        # What the session subscribed goes on to come: what is mapped again later needs no other one.
        plan = replace(plan, outputs=tuple(dict.fromkeys((*plan.outputs, *self.plan.outputs))))
        if self._on_change in self._cell.listeners:
            self._cell.listeners.remove(self._on_change)
        self.plan, self._cell = plan, cell
        cell.listeners.append(self._on_change)
        session = self._agreed
        if session is None:
            return
        variables = cell.definition.variables
        reasons = self._unavailable(session)
        self._outputs = SessionOutputs(variables, self._outputs.slots, reasons)
        self._adopting = True
        held = self._inputs.rebind(variables, reasons)
        self._report_availability(reasons, now)
        self._adopting = False
        if cell.accepts_writes:
            quality = cell.image.quality
            cell.adopt(
                {index: value for index, value in held.items() if quality[index] is Quality.NEVER}, now
            )

    # -- called by the client ----------------------------------------------------------------------------------------

    def session_started(self, session: Session) -> None:
        """The set-up is complete; the first package follows."""
        now = clock.now()
        variables = self._cell.definition.variables
        reasons = self._unavailable(session)
        self._outputs = SessionOutputs(variables, session.outputs.slots, reasons)
        self._cycle = 1 / session.series.base_rate if session.series is not None else _CYCLE_UNKNOWN
        self._inputs = ClaimedInputs(variables, session, self._driven, self._cycle)
        self._session = session if self._is_claimed else None
        self._agreed = session
        self._connection.connected()
        self._notes.agreed(session)
        rate = f"{1 / session.period:g} Hz"
        self._cell.robot_connected(
            now, f"controller {session.controller}, RTDE protocol {session.protocol}, {rate}"
        )
        self._report_availability(reasons, now)
        self._recorded.begin(session)

    def inputs_changed(self, session: Session) -> None:
        """Registers that were in use elsewhere are ours now, or others share a recipe.

        New ones can be written once the next package has shown what they hold. The former recipes serve until then.
        """
        if self._is_claimed:
            self._session = session

    def values(self, flat: Sequence[Value], now: float) -> None:
        """A package."""
        clock.judged_now()
        self._recorded.package(flat, now)
        cell = self._cell
        self._measure()
        news = self._outputs.show(cell, flat, now, clock.raw())
        if news:
            self._inputs.look(flat)
            if self._session is not None:
                self._adopt(self._session, flat, now)
            elif self.plan.verify:
                self._compare(flat, now)
        if cell.delivery.under_way:
            for index in self._inputs.delivered(
                flat if news else None, tuple(cell.delivery.under_way), cell.image.values, now
            ):
                cell.delivery.delivered(index)
        if not news and cell.lag_doubtful(now):
            self._client.probe()

    def earlier(self, flat: Sequence[Value], now: float) -> bool:
        """A package that waited together with newer ones. What inputs hold shows in the newest of them alone."""
        clock.judged_now()
        self._recorded.package(flat, now)
        return self._outputs.show_earlier(self._cell, flat, now, clock.raw())

    def session_lost(self, loss: Loss) -> None:
        """The session has ended, or an attempt at one has failed."""
        now = clock.now()
        self._inputs = ClaimedInputs()
        self._session = self._agreed = None
        self._cancel_timers()
        self._cell.health.watchdog_fed = False
        if loss.started:
            self._cell.robot_lost(loss.text, now)
            self._recorded.lost(loss.text)
        else:
            where = address(self.plan.host, self.plan.port)
            self._connection.failed(self._cell.definition.name, where, loss.text, now)

    def probed(self, delay: float) -> None:
        """The controller answered behind all that it had sent before."""
        if self._cell.backlog_probed(delay, clock.now()):
            self._client.reconnect("its clock stood still for a while, or what it sent was held up")

    def text(self, message: TextMessage) -> None:
        """The controller says something; it goes to the log, and the last one to the status."""
        self._notes.text(message, clock.now())
        report_text(self._cell.definition.name, message)

    def strange(self, package: StrangePackage) -> None:
        """A package could not be taken as it came; the session goes on, and further ones like it are only counted."""
        report_strange(self._cell.definition.name, package)

    # -- robot -> cell -----------------------------------------------------------------------------------------------

    def _measure(self) -> None:
        statistics, health = self._client.statistics, self._cell.health
        health.skipped = statistics.skipped
        health.late = statistics.late
        health.frequency = statistics.frequency

    def _unavailable(self, session: Session) -> dict[int, str]:
        """Variables that the session does not serve, and why. Of inputs that we do not claim yet nothing is known."""
        variables = self._cell.definition.variables
        reasons = unavailable(session, variables, dict(self.plan.types))
        if self._is_claimed:
            return reasons
        return {
            index: why for index, why in reasons.items() if variables[index].direction is Direction.OUTPUT
        }

    def _report_availability(self, reasons: Mapping[int, str], now: float) -> None:
        self._notes.refused(self._agreed, reasons, self._cell.definition.variables)
        for index, reason in reasons.items():
            self._cell.set_availability([index], False, reason, now)
        variables = self._cell.definition.variables
        served = (index for index, each in enumerate(variables) if index not in reasons and not each.via)
        self._cell.set_availability(served, True, "", now)

    def _adopt(self, session: Session, flat: Sequence[Value], now: float) -> None:
        """Take over what the controller's inputs hold, as the package reads them back."""
        self._session, self._agreed = None, session
        reasons = self._unavailable(session)
        self._adopting = True
        adopted = self._inputs.adopt(session, flat, now, reasons)
        self._report_availability(reasons, now)
        self._adopting = False
        self._cell.adopt(adopted, now)

    def _compare(self, flat: Sequence[Value], now: float) -> None:
        """See what the controller made of the inputs; what it lost is sent again."""
        cell, delivery = self._cell, self._cell.delivery
        found = self._inputs.compare(
            Package(flat, delivery.given_at, delivery.differing, cell.health.lag, now)
        )
        if found.differ or found.agree or found.follow:
            cell.read_back(found.differ, found.agree, found.follow, now)
        elif delivery.differing:
            self._send_soon(now)

    # -- cell -> robot -----------------------------------------------------------------------------------------------

    def _on_change(self, direction: Direction) -> None:
        if direction is Direction.INPUT:
            self._inputs.release(self._cell.delivery.take_releases())
            self._send_soon(clock.now())

    def _send_soon(self, now: float) -> None:
        """Send what is due, at once or when the controller's next cycle has begun."""
        if self._pending is not None or self._adopting:
            return
        if now >= self._next_send:
            self._send(now)
        else:
            loop = asyncio.get_running_loop()
            self._pending = loop.call_later(self._next_send - now, self._send_pending)

    def _send_pending(self) -> None:
        self._pending = None
        self._send(clock.now())

    def _send(self, now: float) -> None:
        """Send every recipe of which something was given or has changed."""
        if self._adopting:
            return
        cell, inputs, delivery = self._cell, self._inputs, self._cell.delivery
        missing = inputs.incomplete(delivery.given_at)
        if missing:
            cell.complete(missing, now)
        for due in inputs.due(cell.image.values, delivery.given_at, delivery.differing, now):
            self._next_send = now + self._cycle
            if not self._client.send(due.recipe, due.values):
                continue
            alone = inputs.sent(due, now)
            if alone:
                self._client.join(*alone)
            for listener in self.sent_listeners:
                listener()
        self._await_stage(now)

    def _await_stage(self, now: float) -> None:
        end = self._inputs.stage_end
        if end is not None and self._stage is None:
            self._stage = asyncio.get_running_loop().call_later(max(0.0, end - now), self._end_stages)

    def _end_stages(self) -> None:
        """Masks take their own values again."""
        self._stage = None
        now = clock.now()
        self._inputs.end_stages(now)
        self._send(now)

    def _cancel_timers(self) -> None:
        for timer in (self._pending, self._stage):
            if timer is not None:
                timer.cancel()
        self._pending = self._stage = None

    async def _feed_watchdog(self, period: float) -> None:
        while True:
            await asyncio.sleep(period)
            if self.plan.watchdog is not None:
                self._watchdog.feed(self.plan.watchdog, self._cell)


class RobotRuntime(LinkRuntime):
    """Links to controllers."""

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> RobotLink:
        """A link; what a former one counted and drove goes on."""
        assert isinstance(plan, RobotPlan)
        former = context.former
        if not isinstance(former, RobotLink):
            return RobotLink(plan, cell, on_request=context.on_request)
        needs = "has another robot" if KIND.moved(former.plan, plan) else "needs another session"
        cell.robot_lost(f"the new mapping {needs}", context.now)
        return RobotLink(plan, cell, former, on_request=context.on_request)


RUNTIME = RobotRuntime()
"""What the daemon needs of this kind of link."""
