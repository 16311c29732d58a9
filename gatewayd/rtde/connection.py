"""One connection to a controller, from its first byte to its loss; `gatewayd.rtde.client` makes one after another."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from typing import ClassVar, cast

from gatewayd.report.format import counted
from gatewayd.rtde.claims import HandshakeError, InputRecipe
from gatewayd.rtde.codec import ClientProtocol, ProtocolError
from gatewayd.rtde.delivery import BEGINNING, OutputDelivery, SteadyOutput
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
from gatewayd.rtde.receiving import PackageReceiver
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.sending import PackageSender, StreamTap
from gatewayd.rtde.session import ClientSettings, Session, Wishes
from gatewayd.rtde.silence import Silence
from gatewayd.rtde.steps import NextStep, Notice
from gatewayd.rtde.strange import Oddity, StrangePackage, odd_data
from gatewayd.rtde.timers import Deadline, ProbeTimer, RetryTimer
from gatewayd.rtde.waiters import Waiters

_MEASURE_EVERY = 1.0


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
        """The way out, and its observer."""
        self.receiver = PackageReceiver(self.buffer_updated, self._interrupted)
        """The way in, and who reads it."""
        self._negotiation = Negotiation(settings)
        self.claims = self._negotiation.claims
        self._complained = False
        self._lost = loop.create_future()
        self._waiters = Waiters()
        self._deadline = Deadline(self._unanswered)
        self._check = Deadline(self._watch)
        self._retry = RetryTimer(settings.claim_retry, self.claim)
        self._probe = ProbeTimer(settings.handshake_timeout, self._probe_ended)
        self._asked_at: float | None = None
        self._round_trip = 0.0
        self._delivery: OutputDelivery | None = None
        self._steady = SteadyOutput()
        self._change: Wishes | None = None
        self._questions = PropertyQuestions()
        self._silence = Silence(settings)
        self._measured = 0.0
        self._was_paused = False

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

    def claim(self) -> None:
        """Ask for inputs that are in use or were not asked for yet; only with a session, and if no answer is due."""
        self._claim(self._negotiation.retry_claims())
        self._schedule_retry()

    def probe(self) -> bool:
        """Ask something whose answer queues behind the packages; False if no answer can be expected to it."""
        if self.session is None or self.done.done() or self._probe.running:
            return False
        question = self._negotiation.probe()
        if question is None:
            return False
        self._probe.start()
        self._write(question)
        return not self.done.done()

    def trace(self, tap: StreamTap | None) -> None:
        """Hand `tap` all bytes from now on; None: no more."""
        self.sender.tap = tap
        self._steady.size = 0

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
        self.receiver.resume()
        await self.sender.close(self._lost)

    # what asyncio calls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See asyncio.BufferedProtocol."""
        self.sender.open(cast("asyncio.Transport", transport))
        self.receiver.open(cast("asyncio.Transport", transport))
        self._observer.connected(self.sender.own, self.sender.peer)
        self._request(self._negotiation.begin())
        self._watch()

    def get_buffer(self, sizehint: int) -> memoryview:
        """See asyncio.BufferedProtocol."""
        return self.receiver.buffer

    def buffer_updated(self, nbytes: int) -> None:
        """See asyncio.BufferedProtocol."""
        buffer, steady = self.receiver.buffer, self._steady
        try:
            if nbytes != steady.size or BEGINNING.unpack_from(buffer)[0] != steady.beginning:
                self._receive(bytes(buffer[:nbytes]))
                return
            # Nearly every read brings just what is to come. It is taken in by as few functions as can be: caches that
            # others have used for 2 ms make each line cost several times its usual time.
            delivery = self._delivery
            assert delivery is not None
            steady.taken += nbytes
            self._silence.heard = now = self._loop.time()
            restarted = delivery.deliver_newest(delivery.outputs.unpack_from(buffer, BEGINNING.size), now)
            if restarted is not None:
                self._fail(LossReason.RESTARTED, restarted)
        except Exception as error:  # noqa: BLE001  see `_broken`
            self._broken(error)

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio.BufferedProtocol."""
        self._lost.set_result(None)
        self.receiver.close()
        self._conclude(connection_failure(exc if isinstance(exc, OSError) else None, self._settings.address))

    def _broken(self, error: Exception) -> None:
        """A handler has raised this. asyncio would log it and go on; so `done` has it, and `run` raises it."""
        self._end()
        if not self.done.done():
            self.done.set_exception(error)

    # messages

    def _receive(self, data: bytes) -> None:
        self.sender.received(data)
        self._codec.skip(self._steady.stop())
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
        self._find_steady()

    def _find_steady(self) -> None:
        recipe, delivery, negotiation = self._negotiation.outputs_id, self._delivery, self._negotiation
        if recipe is None or delivery is None or self._codec.buffered or self.done.done() or self.sender.tap:
            return
        if negotiation.running and self._silence.regular:
            self._steady.expect(self._codec.data_header(recipe, delivery.outputs.size), delivery.outputs.size)

    def _pass_over(self, package: StrangePackage) -> None:
        self._silence.odd = package
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
            self._await(self._silence.patience)
        elif not self._negotiation.waiting:
            self._deadline.cancel()
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
        agreed = [one.payload for one in packages if one.recipe == recipe and len(one.payload) == size]
        if len(agreed) < len(packages):
            for odd in odd_data(packages, recipe, size):
                self._pass_over(odd)
        packages.clear()
        if not agreed:
            return
        self._silence.data(now)
        restarted = delivery.deliver(agreed, now, self.done.done)
        if restarted is not None:
            self._fail(LossReason.RESTARTED, restarted)

    def _started(self) -> None:
        now = self._loop.time()
        session = self.session = self._negotiation.session(self._round_trip)
        self.started_at = self._silence.heard = self._measured = now
        self._statistics.sessions += 1
        self._expect_packages(session)
        self._schedule_retry()
        self._handler.session_started(session)

    def _expect_packages(self, session: Session) -> None:
        handler, statistics, every = self._handler, self._statistics, self._settings.every
        self.receiver.expect((BEGINNING.size + session.outputs.size) / session.period)
        self._silence.expect(session.period)
        self._delivery = OutputDelivery(session, handler, statistics, self._silence.heard, every=every)

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
        self._silence.heard = self._loop.time()
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
        self._silence.heard = self._loop.time()
        self._waiters.wake()

    def _probe_ended(self, delay: float) -> None:
        try:
            self._handler.probed(delay)
        except Exception as error:  # noqa: BLE001  see `_broken`
            self._broken(error)

    _EVENTS: ClassVar[dict[Notice, Callable[[Connection], None]]] = {
        Notice.STARTED: _started,
        Notice.INPUTS_CHANGED: _inputs_changed,
        Notice.CHANGED: _changed,
        Notice.PAUSED: _paused,
        Notice.RESUMED: _resumed,
        Notice.PROBED: lambda self: self._probe.answered(),
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
        self._steady.size = 0
        self._asked_at = self._loop.time()
        self._await(self._settings.handshake_timeout)

    def _await(self, seconds: float) -> None:
        if not self.done.done():
            self._deadline.set(seconds)

    async def _ask(self, message: ExecutableMessage | None) -> None:
        if message is None or self.done.done():
            return
        self._request(message)
        if not self.done.done():
            await self._waiters.wait()

    # clocks

    def _unanswered(self) -> None:
        if self._negotiation.reading:
            self._fall_silent(self._silence.patience, first=self.session is None)
            return
        what, limit = self._negotiation.awaited, self._settings.handshake_timeout
        instead = self._silence.instead(self._codec.unfinished)
        self._fail(LossReason.UNANSWERED, f"{what} did not arrive within {limit:g} s{instead}")

    def _fall_silent(self, seconds: float, *, first: bool) -> None:
        instead = self._silence.instead(self._codec.unfinished)
        if not instead and first:
            instead = ": is the robot powered and its safety set-up confirmed?"
        self._fail(LossReason.SILENT, f"no data from the controller for {seconds:.1f} s{instead}")

    def gap(self) -> None:
        """The process stood still until now: what the controller sent meanwhile is still to be read."""
        self._silence.heard = now = self._loop.time()
        if self._delivery is not None:
            self._delivery.pace.gap(now)

    def _watch(self) -> None:
        self._statistics.progress += 1
        now = self._loop.time()
        silence = self._silence.exceeded(now)
        if self._negotiation.running and silence is not None:
            first = self._delivery is None or self._delivery.pace.timestamp is None
            self._fall_silent(silence, first=first)
            return
        if self._delivery is not None and now - self._measured >= _MEASURE_EVERY:
            self._delivery.pace.measure(now)
            self._measured = now
        self._check.set(min(self._settings.data_timeout / 4, _MEASURE_EVERY / 2))

    def _schedule_retry(self) -> None:
        if self._negotiation.claims.retriable and not self.done.done():
            self._retry.schedule()

    def _claim(self, request: ExecutableMessage | None) -> None:
        if self._negotiation.claims.exhausted:
            self._give_up_recipes()
        elif request is not None:
            self._request(request)

    # ends

    def _interrupted(self) -> None:
        self._fail(LossReason.FAILED, "a signal handler interrupted the reading of what the controller sent")

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
        self._steady.size = 0
        for timer in (self._deadline, self._check, self._retry, self._probe):
            timer.cancel()
        self._pause_answered()
