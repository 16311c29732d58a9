"""An RTDE client that keeps itself connected: one asyncio task, synchronous callbacks, no logging of its own.

It negotiates, subscribes, claims, and starts over with the full set-up whenever the connection ends, be it the boot
restart of a controller or a pulled cable. Packages are handed on from within the read of the socket, in their
order, also those that waited together. The decisions are in `gatewayd.rtde.negotiation`, one connection in
`gatewayd.rtde.connection`; here connections follow one another.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace

from gatewayd.loop.connect import DeadPeer, connect
from gatewayd.loop.progress import wait_with_progress
from gatewayd.rtde.claims import ClaimStanding, InputRecipe
from gatewayd.rtde.connection import Connection
from gatewayd.rtde.handler import ClientHandler, ConnectionObserver
from gatewayd.rtde.lists import ListMemory
from gatewayd.rtde.loss import Loss, connect_failure
from gatewayd.rtde.messages import PropertiesReply, TextMessage
from gatewayd.rtde.pace import Statistics
from gatewayd.rtde.receiving import PackageReceiver
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.sending import StreamTap
from gatewayd.rtde.session import ClientSettings, Session


class RtdeClient:
    """One robot controller, for as long as `run` runs."""

    def __init__(
        self, settings: ClientSettings, handler: ClientHandler, observer: ConnectionObserver | None = None
    ) -> None:
        self.statistics = Statistics()
        """Counters over all sessions."""
        self._settings = settings
        self._handler = handler
        self._observer = observer or ConnectionObserver()
        self._connection: Connection | None = None
        self._tap: StreamTap | None = None
        self._lists = ListMemory()
        self._paused = not settings.running
        self._delay = settings.backoff

    @property
    def session(self) -> Session | None:
        """What is agreed with the controller now; None without a session."""
        return self._connection.session if self._connection is not None else None

    @property
    def settings(self) -> ClientSettings:
        """What is wanted now."""
        return self._settings

    @property
    def own_address(self) -> tuple[str, int] | None:
        """Our end of the connection; None without one."""
        return self._connection.sender.own if self._connection is not None else None

    @property
    def peer_address(self) -> tuple[str, int] | None:
        """The controller's end of the connection; None without one."""
        return self._connection.sender.peer if self._connection is not None else None

    @property
    def receiver(self) -> PackageReceiver | None:
        """Who reads the socket of the session; None without a session."""
        connection = self._connection
        return connection.receiver if connection is not None and connection.session is not None else None

    def send(self, recipe: InputRecipe, values: Sequence[Scalar]) -> bool:
        """Send values of one of `session.inputs`, flat in the order of its `recipe`, in one package.

        A recipe can be sent until its connection ends, also when a later session object has another one in its place.
        Never waits. False if there is no session, the recipe is another connection's, or the controller has stopped
        reading. ValueError if a value does not fit its type.
        """
        return self._connection is not None and self._connection.send(recipe, values)

    def join(self, *fields: str) -> None:
        """Have `session.unread` registers, which have been sent, share a recipe with the others.

        `ClientHandler.inputs_changed` reports the new recipes. No effect without a session, for fields that are no such
        registers, and where the recipe ids of the connection run short: the field keeps its own recipe then.
        """
        if self._connection is not None:
            self._connection.join(fields)

    def claim(self) -> None:
        """Ask once for the inputs that are claimed on request; no effect while an answer is due.

        `ClientHandler.inputs_changed` reports what was claimed, `standing` how the claim stands as a whole.
        """
        if self.session is not None and self._connection is not None:
            self._connection.claim()

    @property
    def standing(self) -> ClaimStanding | None:
        """How claims on request stand; None without a session."""
        connection = self._connection
        return (
            connection.claims.standing if connection is not None and connection.session is not None else None
        )

    def probe(self) -> bool:
        """Ask the controller something whose answer queues behind the packages: `ClientHandler.probed` reports when.

        False if nothing was asked: without a session, and while the last question is open.
        """
        return self._connection is not None and self._connection.probe()

    def say(self, message: TextMessage) -> bool:
        """Send a text for the controller's log, cut to 255 bytes; False without a session."""
        return self._connection is not None and self._connection.say(message)

    def properties(self, names: tuple[str, ...], answered: Callable[[PropertiesReply], None]) -> bool:
        """Ask for properties; `answered` is called if an answer comes, which an old controller does not give.

        False if nothing was asked: without a session, and when too many questions are unanswered already.
        """
        return self._connection is not None and self._connection.properties(names, answered)

    def change(self, settings: ClientSettings) -> None:
        """Want something else from now on: set up at once where a session is paused, else by the next connection.

        On the same connection only outputs, frequency and `Wishes.recipes` change; `ConnectionObserver.changed` says
        when they have.
        """
        self._settings = settings
        if self._connection is not None:
            self._connection.change(settings)

    def back_off(self, first: float, longest: float) -> None:
        """Wait so long before new connections from now on, in seconds; no effect if it is so already."""
        if (self._settings.backoff, self._settings.backoff_limit) != (first, longest):
            self._settings = replace(self._settings, backoff=first, backoff_limit=longest)
            self._delay = first

    def trace(self, tap: StreamTap | None) -> None:
        """Hand `tap` the bytes of this connection and of those to come; None: no more."""
        self._tap = tap
        if self._connection is not None:
            self._connection.trace(tap)

    def gap(self) -> None:
        """The process stood still until now: for that time nobody is taken for silent."""
        if self._connection is not None:
            self._connection.gap()

    def reconnect(self, text: str) -> None:
        """End the connection once, for the reason that `text` gives, and set up a new one."""
        if self._connection is not None:
            self._connection.reconnect(text)

    async def pause(self) -> None:
        """Have the controller pause its output, in this session and in those to come."""
        self._paused = True
        if self._connection is not None:
            await self._connection.pause()

    async def resume(self) -> None:
        """Have it send again."""
        self._paused = False
        if self._connection is not None:
            await self._connection.resume()

    async def run(self) -> None:
        """Stay connected until cancelled; what was sent before is still delivered. Raises what a handler raises."""
        self._delay = self._settings.backoff
        attempts = 0
        while True:
            loss, lasted = await self._session()
            attempts = 0 if loss.started else attempts + 1
            if lasted > self._settings.backoff_limit:
                self._delay = self._settings.backoff
            delay = self._delay
            self._handler.session_lost(replace(loss, attempts=attempts, retry_in=delay))
            await wait_with_progress(asyncio.sleep(delay), self._count, delay)
            self._delay = min(2 * delay, self._settings.backoff_limit)

    async def _session(self) -> tuple[Loss, float]:
        """One connection: how it ended, and for how long a session was up."""
        settings = replace(
            self._settings,
            limited=self._settings.limited or self._lists.limited,
            running=not self._paused,
        )
        connecting = asyncio.ensure_future(self._connect(settings))
        try:
            connection = await wait_with_progress(connecting, self._count, settings.connect_timeout)
        except OSError as error:
            return connect_failure(error, settings.address), 0.0
        except asyncio.CancelledError:
            if not connecting.cancelled() and connecting.exception() is None:
                await connecting.result().close()  # it came about as the wait for it was cancelled
            raise
        self._connection = connection
        try:
            loss = await connection.done
        finally:
            self._connection = None
            self.statistics.frequency = 0.0
            await connection.close()
        self._lists.learn(connection.lists, started=connection.started_at is not None)
        if connection.started_at is None:
            return loss, 0.0
        return replace(loss, started=True), asyncio.get_running_loop().time() - connection.started_at

    async def _connect(self, settings: ClientSettings) -> Connection:
        unacknowledged = max(1000, int(self._settings.data_timeout * 1000))
        async with asyncio.timeout(settings.connect_timeout):
            return await connect(
                lambda: self._new_connection(settings),
                self._settings.host,
                self._settings.port,
                DeadPeer(idle=1, interval=1, probes=3, unacknowledged=unacknowledged),
            )

    def _new_connection(self, settings: ClientSettings) -> Connection:
        connection = Connection(settings, self._handler, self.statistics, self._observer)
        connection.trace(self._tap)
        return connection

    def _count(self) -> None:
        self.statistics.progress += 1
