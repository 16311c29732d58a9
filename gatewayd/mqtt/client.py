"""A client that keeps itself connected to a broker: one asyncio task, synchronous callbacks, no logging of its own.

Nothing waits in it for a broker: a message is taken at once or not at all, and who gives it decides what then. Looking
up a name and reading certificates are the only work of threads, one at a time; connecting and TLS are the loop's.
"""

from __future__ import annotations

import asyncio
import errno
import os
import random
import socket
import ssl
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

from gatewayd.loop.progress import STEP, wait_with_progress
from gatewayd.loop.resolve import SocketAddress, resolve
from gatewayd.loop.retry import reason_of
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.mqtt.connection import BrokerConnection
from gatewayd.mqtt.credentials import BrokerCredentials, CredentialsError, needs_files, read_credentials
from gatewayd.mqtt.messages import BrokerSettings, Message, Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.mqtt.pause import ReconnectPause

CONNECT_WITHIN = 5.0
"""Seconds for each step: look-up, connection with TLS, the broker's answer."""
READ_RATE = 200.0
"""Messages with QoS 0 a second that are read; a burst of as many. What comes beyond costs a few microseconds each."""
_LEAVE_WITHIN = 1.0


class ClientUser(Protocol):
    """What the user of a client gets to know. Nothing of it may raise."""

    async def preparing(self) -> None:
        """An attempt is about to be made; it may wait for a moment."""

    def will(self) -> Message | None:
        """What the broker is to publish when the connection ends without a word; asked before each attempt."""

    def connected(self) -> None:
        """The broker has taken the connection."""

    def received(self, message: Received) -> None:
        """A message came."""

    def oversized(self, message: Oversized) -> None:
        """One came that was too large to be read."""

    def flooded(self, count: int) -> None:
        """So many messages were let pass unread, because more came than are read."""

    def subscription(self, topics: Sequence[str], why: str) -> None:
        """The broker sends these topics; or it does not, and why."""

    def lost(self, reason: str, *, was_connected: bool) -> None:
        """There is no connection."""


class MqttClient:
    """One connection after another, until `run` is cancelled."""

    def __init__(
        self, settings: BrokerSettings, user: ClientUser, chance: Callable[[], float] = random.random
    ) -> None:
        self.settings = settings
        self.connections = 0
        self.progress = 0
        """Moves several times a second while `run` works, whatever the broker does."""
        self.tap: Callable[[bytes, bool, tuple[str, int] | None], object] | None = None
        self.read_rate = READ_RATE
        self._user = user
        self._pause = ReconnectPause(chance)
        self._connection: BrokerConnection | None = None
        self._has_left = False

    @property
    def is_connected(self) -> bool:
        """Whether a broker has taken the connection."""
        return self._connection is not None

    @property
    def writable(self) -> bool:
        """Whether a message would be taken now."""
        return self._connection is not None and self._connection.writable

    async def run(self) -> None:
        """Stay connected until cancelled."""
        while True:
            reason, was_connected = await self._one()
            if self._has_left:
                return
            self._user.lost(reason, was_connected=was_connected)
            pause = self._pause.failed()
            await wait_with_progress(asyncio.sleep(pause), self._step, pause)

    def publish(self, message: Message) -> bool:
        """Send a message; False: the broker does not take it now."""
        return self._connection is not None and self._connection.publish(message)

    def subscribe(self, topics: Sequence[str], qos: int = 0) -> None:
        """Ask for messages, on this connection."""
        if self._connection is not None:
            self._connection.subscribe(topics, qos)

    def unsubscribe(self, topics: Sequence[str]) -> None:
        """Ask for them no more."""
        if self._connection is not None:
            self._connection.unsubscribe(topics)

    def gap(self, since: float, until: float) -> None:
        """The process stood still."""
        if self._connection is not None:
            self._connection.gap(since, until)

    def reconnect(self, reason: str) -> None:
        """End this connection, and have another one. What was published before is sent before."""
        if self._connection is not None:
            asyncio.get_running_loop().call_soon(self._connection.leave, reason)

    async def leave(self) -> None:
        """Say good-bye; `run` ends by that, or is cancelled afterwards."""
        self._has_left = True
        connection, self._connection = self._connection, None
        if connection is None:
            return
        connection.leave()
        await asyncio.wait((connection.lost,), timeout=_LEAVE_WITHIN)

    # -- inside ------------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        self.progress += 1

    async def _one(self) -> tuple[str, bool]:
        """Why there was no connection, or none any more, and whether there was one."""
        work = self._open()
        connection: BrokerConnection | None = None
        try:
            connection = await wait_with_progress(work, self._step, 4 * CONNECT_WITHIN)
        except OSError as error:
            return _words(error), False
        self._connection = connection
        self.connections += 1
        try:
            self._user.connected()
            return await self._keep(connection), True
        finally:
            self._connection = None
            connection.end("the link has ended")

    async def _keep(self, connection: BrokerConnection) -> str:
        """Until it is lost; a connection that lasted is no failed attempt."""
        steps = 0
        while not connection.lost.done():
            self._step()
            connection.tick()
            unread = connection.take_unread()
            if unread:
                self._user.flooded(unread)
            await asyncio.wait((connection.lost,), timeout=STEP)
            steps += 1
            if steps * STEP > CONNECT_WITHIN:
                self._pause.worked()
        return connection.lost.result()

    async def _open(self) -> BrokerConnection:
        """A connection that the broker has taken. Raises OSError."""
        await self._user.preparing()
        credentials = BrokerCredentials()
        if needs_files(self.settings):
            read = in_daemon_thread(partial(read_credentials, self.settings), "mqtt credentials")
            credentials = await asyncio.wait_for(read, CONNECT_WITHIN)
        found = await resolve(self.settings.host, self.settings.port, CONNECT_WITHIN)
        failure = OSError(f"{self.settings.host} has no address")
        for address in found:
            try:
                return await self._try(address, credentials)
            except OSError as error:
                failure = error
        raise failure

    async def _try(self, address: SocketAddress, credentials: BrokerCredentials) -> BrokerConnection:
        loop = asyncio.get_running_loop()
        connection = BrokerConnection(self.settings, credentials.password, self._user.will(), self.read_rate)
        connection.received = self._user.received
        connection.oversized = self._user.oversized
        connection.subscribed = self._user.subscription
        connection.passed = partial(self._passed, connection)
        tls = credentials.tls
        try:
            async with asyncio.timeout(CONNECT_WITHIN):
                await loop.create_connection(
                    lambda: connection,
                    str(address[3][0]),
                    self.settings.port,
                    ssl=tls,
                    server_hostname=self.settings.host if tls is not None else None,
                )
            async with asyncio.timeout(CONNECT_WITHIN):
                await asyncio.shield(connection.accepted)
        except TimeoutError:
            connection.end("no answer")
            raise TimeoutError(f"no answer within {CONNECT_WITHIN:g} s") from None
        except BaseException:
            connection.end("not connected")
            raise
        return connection

    def _passed(self, connection: BrokerConnection, data: bytes, outgoing: bool) -> None:
        if self.tap is not None:
            self.tap(data, outgoing, connection.own_address)


def _words(error: OSError) -> str:
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is not accepted: {error.verify_message}"
    if isinstance(error, ssl.SSLError):
        return f"TLS: {(error.reason or 'failed').lower().replace('_', ' ')}"
    if (
        error.errno is not None
        and error.errno in errno.errorcode
        and not isinstance(error, CredentialsError | socket.gaierror)
    ):
        return os.strerror(error.errno)  # asyncio puts the address there, which the report has anyway
    return reason_of(error) or type(error).__name__
