"""From a client's calls to what a program sees: samples, events, state, and who waits for any of them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from enum import Enum
from typing import TypeVar

from gatewayd.rtde.api.errors import ConnectFailedError, ConnectionLostError
from gatewayd.rtde.api.events import (
    AttemptFailedEvent,
    ConnectedEvent,
    ErrorEvent,
    LostEvent,
    OverflowEvent,
    PausedEvent,
    RefusedEvent,
    RobotEvent,
    SetUpEvent,
    StartedEvent,
    TextEvent,
)
from gatewayd.rtde.api.retry import ONCE, Attempts, Retry
from gatewayd.rtde.api.sample import Sample, SampleLayout
from gatewayd.rtde.api.stream import BoundedStream
from gatewayd.rtde.api.wanted import Wanted
from gatewayd.rtde.handler import ConnectionObserver
from gatewayd.rtde.loss import Loss, LossReason
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.session import Session, Unavailable
from gatewayd.rtde.strange import StrangePackage
from gatewayd.rtde.waiters import Waiters

_EVENTS = 1000
_Result = TypeVar("_Result")


class ConnectionState(Enum):
    """How far a robot's connection is."""

    NEW = "not opened"
    CONNECTING = "connecting"
    INITIALISING = "setting up"
    RUNNING = "running"
    PAUSED = "paused"
    LOST = "lost"
    """Given up, or lost where no new connection is to be made by itself: `Robot.reconnect` tries anew."""
    CLOSED = "closed"


IN_SESSION = frozenset({ConnectionState.RUNNING, ConnectionState.PAUSED})


class RobotFeed(ConnectionObserver):
    """Handler and observer of one client. `reconnect`: the limits after a loss; None: no attempt by itself."""

    def __init__(self, wanted: Wanted, reconnect: Retry | None, *, running: bool, buffer: int) -> None:
        self.wanted = wanted
        """What the program wants."""
        self.running = running
        """Whether the output is to run in the sessions to come."""
        self.state = ConnectionState.NEW
        self.session: Session | None = None
        self.latest: Sample | None = None
        """The newest sample of the session; None while there is none."""
        self.last_text: TextMessage | None = None
        self.last_loss: Loss | None = None
        self.failure: Exception | None = None
        """Why there is no session and none is tried for."""
        self.given_up = False
        """Whether the client ends, or has ended, because the limits of the attempts are reached."""
        self.events: BoundedStream[RobotEvent] = BoundedStream(_EVENTS)
        self.set_ups = 0
        """Times that recipes have been agreed."""
        self.samples = 0
        """Samples received so far."""
        self.written: dict[str, tuple[Scalar, ...]] = {}
        """What was sent in this session, by field."""
        self.streams: list[BoundedStream[Sample]] = []
        self.main = self.stream(buffer)
        self.started: Callable[[], None] = lambda: None
        """Called when a session has come about."""
        self._reconnect = reconnect
        self._attempts = Attempts(ONCE)
        self._layout: SampleLayout | None = None
        self._claimed = 0
        self._connected = False
        self._ever = False
        self._missing: tuple[Unavailable, ...] = ()
        self._waiters = Waiters()

    # for the robot

    @property
    def layout(self) -> SampleLayout | None:
        """That of the session's samples."""
        return self._layout

    @property
    def reading(self) -> Sample | None:
        """The newest sample if it was sent after the last claim: it shows what the claimed inputs hold."""
        return self.latest if self.samples > self._claimed else None

    def stream(self, limit: int) -> BoundedStream[Sample]:
        """Another buffer that gets every sample from now on."""
        stream: BoundedStream[Sample] = BoundedStream(limit, self._overflowed)
        if limit:
            self.streams.append(stream)
            stream.closing = lambda: self.streams.remove(stream)
        else:
            stream.end(ValueError("buffer=0 keeps no samples: use latest or newer, or a stream of your own"))
        return stream

    def begin(self, retry: Retry) -> None:
        """Attempts at a session begin, within these limits."""
        self.limit(retry)
        self._ever = False
        self.failure = None
        self.given_up = False
        self.state = ConnectionState.CONNECTING
        for stream in self.streams:
            stream.reopen()

    def limit(self, retry: Retry) -> None:
        """The next session is to come about within these limits."""
        self._attempts = Attempts(retry)

    def unavailable(self, session: Session) -> tuple[Unavailable, ...]:
        """The wanted fields that the controller does not give."""
        names = self.wanted.names
        return tuple(each for each in session.unavailable if (each.field, each.output) in names)

    def give_up(self, error: Exception, state: ConnectionState) -> None:
        """No session is tried for any more: waiting callers get `error`; readers the end if it was `state` CLOSED."""
        self.state, self.failure = state, error
        self._end_session()
        closed = state is ConnectionState.CLOSED
        for stream in self.streams:
            stream.end(None if closed else error)
        if closed:
            self.events.end()
        self._waiters.wake()

    async def until(self, condition: Callable[[], _Result | None], timeout: float | None) -> _Result:  # noqa: ASYNC109
        """The first result of `condition` that is not None, asked now and whenever something has happened.

        TimeoutError after `timeout` seconds; ConnectionLostError once there is no session and none is tried for.
        """
        async with asyncio.timeout(timeout):
            while (result := condition()) is None:
                if self.failure is not None:
                    raise self.failure
                await self._waiters.wait()
        return result

    # what the client calls

    def connected(self, own: tuple[str, int] | None, peer: tuple[str, int] | None) -> None:
        """See ConnectionObserver."""
        self._connected = True
        self.state = ConnectionState.INITIALISING
        self._tell(ConnectedEvent(_address(own), _address(peer)))

    def session_started(self, session: Session) -> None:
        """See ClientHandler. TypesDifferError ends the client."""
        self.wanted.check_types(session)
        self.written.clear()
        self._ever = True
        self._attempts = Attempts(self._reconnect)
        self.started()
        self._set_up(session)
        self.state = ConnectionState.RUNNING if self.running else ConnectionState.PAUSED
        if self.running:
            self._tell(StartedEvent())

    def values(self, values: tuple[Scalar, ...], now: float) -> None:
        """See ClientHandler."""
        layout = self._layout
        assert layout is not None
        self.latest = sample = layout.sample(layout, values, now)
        self.samples += 1
        for stream in self.streams:
            stream.put(sample)
        if self._waiters.waiting:
            self._waiters.wake()

    def earlier(self, values: tuple[Scalar, ...], now: float) -> bool:
        """See ClientHandler."""
        self.values(values, now)
        return True

    def inputs_changed(self, session: Session) -> None:
        """See ClientHandler."""
        self.session = session
        self._claimed = self.samples
        self._report_missing(session)
        if self.state is ConnectionState.RUNNING and not self.running:
            self.paused()
        self._waiters.wake()

    def changed(self, session: Session) -> None:
        """See ConnectionObserver. TypesDifferError ends the client."""
        self.wanted.check_types(session)
        self._set_up(session)

    def paused(self) -> None:
        """See ConnectionObserver."""
        self.state = ConnectionState.PAUSED
        self._tell(PausedEvent())

    def resumed(self) -> None:
        """See ConnectionObserver."""
        self.state = ConnectionState.RUNNING
        self._tell(StartedEvent())

    def session_lost(self, loss: Loss) -> None:
        """See ClientHandler. ConnectFailedError or ConnectionLostError ends the client."""
        self.last_loss = loss
        connected, self._connected = self._connected, False
        now = asyncio.get_running_loop().time()
        asked_for = loss.started and loss.reason is LossReason.RECONNECT
        goes_on = asked_for or self._attempts.failed(
            loss.reason, connected=connected, now=now, delay=loss.retry_in
        )
        self.state = ConnectionState.CONNECTING
        self._end_session()
        self.given_up = not goes_on
        event = LostEvent if loss.started else AttemptFailedEvent
        self._tell(event(loss, final=not goes_on))
        if not goes_on:
            raise (ConnectionLostError if self._ever else ConnectFailedError)(loss.text, loss)

    def text(self, message: TextMessage) -> None:
        """See ClientHandler."""
        self.last_text = message
        self._tell(TextEvent(message.message, message.source, message.level))

    def strange(self, package: StrangePackage) -> None:
        """See ClientHandler."""
        self._tell(ErrorEvent(f"odd package: {package}"))

    def probed(self, delay: float) -> None:
        """See ClientHandler: nobody probes."""

    # within

    def _set_up(self, session: Session) -> None:
        self.session = session
        self.set_ups += 1
        self.latest = None
        self._layout = SampleLayout(session.outputs, self.wanted.outputs)
        self._missing = ()
        self._tell(SetUpEvent(session))
        self._report_missing(session)

    def _report_missing(self, session: Session) -> None:
        missing = self.unavailable(session)
        if missing != self._missing:
            self._missing = missing
            if missing:
                self._tell(RefusedEvent(missing))

    def _end_session(self) -> None:
        self.session = self.latest = None
        self.written.clear()

    def _overflowed(self, lost: int, total: int) -> None:
        self._tell(OverflowEvent(lost, total))

    def _tell(self, event: RobotEvent) -> None:
        self.events.put(event)
        self._waiters.wake()


def _address(socket_name: tuple[str, int] | None) -> tuple[str, int] | None:
    """Host and port alone: IPv6 has more."""
    return socket_name[:2] if socket_name else None
