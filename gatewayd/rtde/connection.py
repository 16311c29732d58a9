"""One connection to a controller, from its first byte to its loss; `gatewayd.rtde.client` makes one after another."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterable, Sequence
from typing import ClassVar, cast

from gatewayd.report.format import counted
from gatewayd.rtde.claims import HandshakeError, InputRecipe
from gatewayd.rtde.codec import ClientProtocol, ProtocolError
from gatewayd.rtde.delivery import OutputDelivery
from gatewayd.rtde.handler import ClientHandler, ConnectionObserver
from gatewayd.rtde.lists import ListOutcome
from gatewayd.rtde.loss import Loss, LossReason, connection_failure
from gatewayd.rtde.messages import (
    ANSWER_TYPES,
    ControllerMessage,
    DataPackage,
    ExecutableMessage,
    Pause,
    PropertiesReply,
    ReadProperties,
    TextLevel,
    TextMessage,
)
from gatewayd.rtde.negotiation import Negotiation
from gatewayd.rtde.pace import Statistics
from gatewayd.rtde.properties import PropertyQuestions
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.sending import PackageSender
from gatewayd.rtde.session import ClientSettings, Session, Wishes
from gatewayd.rtde.steps import NextStep, Notice
from gatewayd.rtde.strange import Oddity, StrangePackage, odd_data

_FIRST_CLAIM_RETRY = 0.1
_MEASURE_EVERY = 1.0
_PERIODS_OF_PATIENCE = 5
_READ = 65536
"""Bytes of the buffer that every read goes into: a fresh one for each would cost more than its package."""


class Connection(asyncio.BufferedProtocol):
    """Sockets to negotiation and back. `done` becomes the loss, or the exception of a handler."""

    def __init__(
        self,
        settings: ClientSettings,
        handler: ClientHandler,
        statistics: Statistics,
        observer: ConnectionObserver,
    ) -> None:
        loop = asyncio.get_running_loop()
        self.done: asyncio.Future[Loss] = loop.create_future()
        """How the connection ended."""
        self.session: Session | None = None
        """What was agreed; None before the set-up is complete and after the end."""
        self.started_at: float | None = None
        """When the set-up was complete."""
        self._loop = loop
        self._settings = settings
        self._handler = handler
        self._observer = observer
        self._statistics = statistics
        self._codec = ClientProtocol()
        self.sender = PackageSender(self._codec)
        """The way out, and whoever looks on."""
        self._negotiation = Negotiation(settings)
        self._complained = False
        self._lost = loop.create_future()
        self._waiters: list[asyncio.Future[None]] = []
        self._deadline: asyncio.TimerHandle | None = None
        self._check: asyncio.TimerHandle | None = None
        self._retry: asyncio.TimerHandle | None = None
        self._retry_delay = _FIRST_CLAIM_RETRY
        self._probe: asyncio.TimerHandle | None = None
        self._probed_at = 0.0
        self._asked_at: float | None = None
        self._round_trip = 0.0
        self._received = memoryview(bytearray(_READ))
        self._delivery: OutputDelivery | None = None
        self._change: Wishes | None = None
        self._questions = PropertyQuestions()
        self._patience = settings.first_data_timeout
        self._heard = 0.0
        self._measured = 0.0
        self._was_paused = False
        self._passed_over: StrangePackage | None = None
        """The last strange package, if no data came since."""

    @property
    def lists(self) -> ListOutcome:
        """What the connection has shown of the lists that the controller takes."""
        negotiation = self._negotiation
        long = negotiation.awaits_long_list
        return ListOutcome(
            negotiation.controller, negotiation.took_long_list, long, long and self._complained
        )

    # what users do

    def send(self, recipe: InputRecipe, values: Sequence[Scalar]) -> bool:
        """Send the flat values of an accepted recipe in one package; False if it is not one of this session.

        Never waits. ValueError if a value does not fit its type.
        """
        if self.session is None or self.done.done() or not self._negotiation.claims.accepted(recipe):
            return False
        self._write(DataPackage(recipe.id, recipe.recipe.pack(values)))
        self._statistics.writes += 1
        return not self.done.done()

    def join(self, fields: Iterable[str]) -> None:
        """Have unread registers share a recipe with the others."""
        if self.session is not None and not self.done.done():
            self._claim(self._negotiation.join(fields))

    def probe(self) -> bool:
        """Ask something whose answer queues behind the packages; False if no answer can be expected to it."""
        if self.session is None or self.done.done() or self._probe is not None:
            return False
        question = self._negotiation.probe()
        if question is None:
            return False
        self._probed_at = self._loop.time()
        self._probe = self._loop.call_later(self._settings.handshake_timeout, self._probe_unanswered)
        self._write(question)
        return not self.done.done()

    def reconnect(self, text: str) -> None:
        """End the connection for a reason of the user's; what was sent is still delivered."""
        self._conclude(Loss(LossReason.RECONNECT, f"{self._settings.address}: {text}"))

    async def pause(self) -> None:
        """Have the output paused; returns when the controller has answered or the connection is lost."""
        await self._ask(self._negotiation.pause())

    async def resume(self) -> None:
        """Have the output resumed; returns when it is or the connection is lost."""
        await self._ask(self._negotiation.resume())

    def change(self, wishes: Wishes) -> None:
        """Set up other recipes while paused: `ConnectionObserver.changed` says when it is done."""
        if self.session is not None and not self.done.done():
            self._change = wishes
            self._begin_change()

    def say(self, message: TextMessage) -> bool:
        """Send a text; False without a session."""
        if self.session is None or self.done.done():
            return False
        self._write(message)
        return not self.done.done()

    def properties(self, names: tuple[str, ...], answered: Callable[[PropertiesReply], None]) -> bool:
        """Ask for properties; `answered` is called if an answer comes: old controllers are silent.

        False if nothing was asked: without a session, and when too many questions are unanswered already.
        """
        if self.session is None or self.done.done() or not self._questions.ask(names, answered):
            return False
        self._write(ReadProperties(names))
        return not self.done.done()

    async def close(self) -> None:
        """Let what was sent reach the controller, then close. No handler is called any more."""
        self._end()
        self.done.cancel()
        await self.sender.close(self._lost)

    # what asyncio calls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See asyncio.BufferedProtocol."""
        self.sender.open(cast("asyncio.Transport", transport))
        self._observer.connected(self.sender.own, self.sender.peer)
        self._request(self._negotiation.begin())
        self._watch()

    def get_buffer(self, sizehint: int) -> memoryview:
        """See asyncio.BufferedProtocol."""
        return self._received

    def buffer_updated(self, nbytes: int) -> None:
        """See asyncio.BufferedProtocol."""
        data = bytes(self._received[:nbytes])
        self.sender.received(data)
        self._guarded(lambda: self._receive(data))

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio.BufferedProtocol."""
        self._lost.set_result(None)
        self._conclude(connection_failure(exc if isinstance(exc, OSError) else None, self._settings.address))

    def _guarded(self, work: Callable[[], None]) -> None:
        """Do what calls handlers. asyncio would log their exceptions and go on; so `run` raises them."""
        try:
            work()
        except Exception as error:  # noqa: BLE001  see above
            self._end()
            if not self.done.done():
                self.done.set_exception(error)

    # messages

    def _receive(self, data: bytes) -> None:
        now = self._loop.time()
        packages: list[DataPackage] = []
        failure: ProtocolError | None = None
        try:
            for message in self._codec.receive(data):
                if self.done.done():
                    return
                if type(message) is DataPackage:
                    if not self._negotiation.running:
                        self._take(message)
                    if self._negotiation.delivering:
                        packages.append(message)
                elif isinstance(message, StrangePackage):
                    self._pass_over(message)
                else:
                    # What came before an answer was sent before it: it is no reading of what the answer brings.
                    self._deliver(packages, now)
                    self._take(message)
        except ProtocolError as error:
            failure = error
        self._deliver(packages, now)
        if failure is not None:
            self._fail(LossReason.PROTOCOL, f"what the controller sent is not RTDE: {failure}")

    def _pass_over(self, package: StrangePackage) -> None:
        self._passed_over = package
        if self._statistics.strange.count(package):
            self._handler.strange(package)

    def _take(self, message: ControllerMessage) -> None:
        if isinstance(message, TextMessage):
            self._complained |= self._negotiation.awaits_long_list and message.level <= TextLevel.ERROR
            self._handler.text(message)
            return
        if isinstance(message, PropertiesReply):
            strange = self._questions.answer(message)
            if strange:
                self._pass_over(StrangePackage(Oddity.UNEXPECTED, ANSWER_TYPES[type(message)], strange))
            return
        try:
            step = self._negotiation.handle(message)
        except HandshakeError as error:
            self._fail(LossReason.HANDSHAKE, str(error))
            return
        if step.strange:
            self._pass_over(StrangePackage(Oddity.UNEXPECTED, ANSWER_TYPES[type(message)], step.strange))
        if step.taken:
            self._measure_round_trip(message)
            self._follow(step)

    def _follow(self, step: NextStep) -> None:
        if step.send is not None:
            self._request(step.send)
        elif self._negotiation.reading:
            self._await(self._patience)
        elif not self._negotiation.waiting:
            self._disarm()
        if self.done.done():
            return
        if self._negotiation.claims.exhausted:
            self._give_up_recipes()
        elif step.event is not None:
            self._EVENTS[step.event](self)
        self._begin_change()

    def _begin_change(self) -> None:
        """Set up the other recipes that are wanted, as soon as nothing else is under way."""
        wishes, negotiation = self._change, self._negotiation
        if wishes is None or negotiation.waiting or negotiation.running or self.done.done():
            return
        self._change = None
        try:
            step = negotiation.change(wishes)
        except HandshakeError as error:
            self._fail(LossReason.HANDSHAKE, str(error))
        else:
            self._follow(step)

    def _measure_round_trip(self, message: ControllerMessage) -> None:
        if self._asked_at is not None and not isinstance(message, DataPackage):
            self._round_trip = max(self._round_trip, self._loop.time() - self._asked_at)
            self._asked_at = None

    def _deliver(self, packages: list[DataPackage], now: float) -> None:
        """Hand on the packages that are of the agreed recipe, in their order, and count them all."""
        delivery = self._delivery
        if delivery is None or not packages or self.done.done():
            return
        recipe, size = self._negotiation.outputs_id, delivery.outputs.size
        agreed = [one for one in packages if one.recipe == recipe and len(one.payload) == size]
        if len(agreed) < len(packages):
            for odd in odd_data(packages, recipe, size):
                self._pass_over(odd)
        packages.clear()
        if not agreed:
            return
        self._heard = now
        self._passed_over = None
        self._patience = max(self._settings.data_timeout, _PERIODS_OF_PATIENCE * delivery.period)
        restarted = delivery.deliver(agreed, now, self.done.done)
        if restarted is not None:
            self._fail(LossReason.RESTARTED, restarted)

    def _started(self) -> None:
        now = self._loop.time()
        session = self.session = self._negotiation.session(self._round_trip)
        self.started_at = self._heard = self._measured = now
        self._statistics.sessions += 1
        self._expect_packages(session)
        self._schedule_retry()
        self._handler.session_started(session)

    def _expect_packages(self, session: Session) -> None:
        handler, statistics, every = self._handler, self._statistics, self._settings.every
        self._delivery = OutputDelivery(session, handler, statistics, self._heard, every=every)

    def _changed(self) -> None:
        self._pause_answered()
        session = self.session = self._negotiation.session(self._round_trip)
        self._was_paused = False
        self._expect_packages(session)
        self._schedule_retry()
        self._observer.changed(session)

    def _paused(self) -> None:
        self._pause_answered()
        self._observer.paused()

    def _inputs_changed(self) -> None:
        self._heard = self._loop.time()
        self._resume_pace()
        self.session = self._negotiation.session(self._round_trip)
        self._schedule_retry()
        self._handler.inputs_changed(self.session)

    def _resumed(self) -> None:
        self._resume_pace()
        self._pause_answered()
        self._observer.resumed()

    def _resume_pace(self) -> None:
        if self._was_paused and self._delivery is not None:
            self._was_paused = False
            self._delivery.pace.resume()

    def _pause_answered(self) -> None:
        self._heard = self._loop.time()
        for waiter in self._waiters:
            if not waiter.done():
                waiter.set_result(None)
        self._waiters.clear()

    def _probe_answered(self) -> None:
        if self._probe is not None:  # else it was given up
            self._probe.cancel()
            self._probe = None
            self._handler.probed(self._loop.time() - self._probed_at)

    def _probe_unanswered(self) -> None:
        self._probe = None
        self._guarded(lambda: self._handler.probed(math.inf))

    _EVENTS: ClassVar[dict[Notice, Callable[[Connection], None]]] = {
        Notice.STARTED: _started,
        Notice.INPUTS_CHANGED: _inputs_changed,
        Notice.CHANGED: _changed,
        Notice.PAUSED: _paused,
        Notice.RESUMED: _resumed,
        Notice.PROBED: _probe_answered,
    }

    # sending

    def _write(self, message: ExecutableMessage) -> None:
        waiting = self.sender.write(message)
        if waiting > self._settings.write_buffer:
            self._fail(
                LossReason.CONGESTED,
                f"the controller does not take what is sent: {counted(waiting, 'byte')} waiting",
            )

    def _request(self, message: ExecutableMessage) -> None:
        self._write(message)
        self._was_paused |= isinstance(message, Pause)
        self._asked_at = self._loop.time()
        self._await(self._settings.handshake_timeout)

    def _await(self, seconds: float) -> None:
        self._disarm()
        if not self.done.done():
            self._deadline = self._loop.call_later(seconds, self._unanswered)

    async def _ask(self, message: ExecutableMessage | None) -> None:
        if message is None or self.done.done():
            return
        waiter: asyncio.Future[None] = self._loop.create_future()
        self._waiters.append(waiter)
        self._request(message)
        await waiter

    # clocks

    def _disarm(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _unanswered(self) -> None:
        if self._negotiation.reading:
            self._fall_silent(self._patience, first=self.session is None)
            return
        what, limit = self._negotiation.awaited, self._settings.handshake_timeout
        self._fail(LossReason.UNANSWERED, f"{what} did not arrive within {limit:g} s{self._instead()}")

    def _fall_silent(self, seconds: float, *, first: bool) -> None:
        instead = self._instead()
        if not instead and first:
            instead = ": is the robot powered and its safety set-up confirmed?"
        self._fail(LossReason.SILENT, f"no data from the controller for {seconds:.1f} s{instead}")

    def _instead(self) -> str:
        """What came in place of what was due, in words."""
        if self._codec.unfinished:
            return f"; what it sent stops at {self._codec.unfinished}"
        return f"; it sent {self._passed_over} instead" if self._passed_over is not None else ""

    def gap(self) -> None:
        """The process stood still until now: what the controller sent meanwhile is still to be read."""
        self._heard = self._loop.time()
        if self._delivery is not None:
            self._delivery.pace.gap(self._heard)

    def _watch(self) -> None:
        self._statistics.progress += 1
        now = self._loop.time()
        silence = now - self._heard
        if self._negotiation.running and silence > self._patience:
            first = self._delivery is None or self._delivery.pace.timestamp is None
            self._fall_silent(silence, first=first)
            return
        if self._delivery is not None and now - self._measured >= _MEASURE_EVERY:
            self._delivery.pace.measure(now)
            self._measured = now
        self._check = self._loop.call_later(
            min(self._settings.data_timeout / 4, _MEASURE_EVERY / 2), self._watch
        )

    def _schedule_retry(self) -> None:
        if self._retry is None and self._negotiation.claims.retriable and not self.done.done():
            delay = min(self._retry_delay, self._settings.claim_retry)
            self._retry_delay = 2 * delay
            self._retry = self._loop.call_later(delay, self._retry_claims)

    def _retry_claims(self) -> None:
        self._retry = None
        self._claim(self._negotiation.retry_claims())
        self._schedule_retry()

    def _claim(self, request: ExecutableMessage | None) -> None:
        if self._negotiation.claims.exhausted:
            self._give_up_recipes()
        elif request is not None:
            self._request(request)

    # ends

    def _give_up_recipes(self) -> None:
        self._fail(
            LossReason.RECIPES,
            "all 255 input recipes of the connection are used up: a new connection is opened",
        )

    def _fail(self, reason: LossReason, text: str) -> None:
        self._conclude(Loss(reason, f"{self._settings.address}: {text}"))
        self.sender.abort()

    def _conclude(self, loss: Loss) -> None:
        self._end()
        if not self.done.done():
            self.done.set_result(loss)

    def _end(self) -> None:
        """Stop everything that could still call a handler."""
        self.session = None
        for handle in (self._deadline, self._check, self._retry, self._probe):
            if handle is not None:
                handle.cancel()
        self._pause_answered()
