"""A client of a dashboard server that keeps itself connected: asks for the robot's state, and gives commands.

One thing at a time: a command goes out between two questions, and nothing is kept for later. One that cannot be sent
now is refused now, so that no robot starts when nobody expects it any more. An answer that does not come ends the
connection, for the one that comes late would be taken for the answer to something else.
"""

from __future__ import annotations

import asyncio
import errno
import socket
from collections.abc import Awaitable, Callable
from typing import Final, Protocol, TypeVar, cast

from gatewayd.dashboard.dialogue import Dialogue, DialogueError
from gatewayd.dashboard.replies import CommandOutcome, DashboardReply, reply_to
from gatewayd.dashboard.requests import ANSWERED_WITHIN, SENT_WITHIN, DashboardRequest, StateQuestion
from gatewayd.dashboard.state import RobotState, Round
from gatewayd.loop import clock
from gatewayd.loop.connect import DeadPeer, connect
from gatewayd.loop.progress import wait_with_progress

CONNECT_WITHIN = 5.0
"""Seconds for a connection."""
GREETED_WITHIN = 10.0
"""Seconds for the first line, which takes longer than others."""
_RETRY, _MAX_RETRY = 1.0, 5.0
"""Seconds before another connection, after the first failure and at most."""

_DEAD_PEER: Final = DeadPeer(idle=1, interval=1, probes=3, unacknowledged=5000)
_Result = TypeVar("_Result")

StreamTap = Callable[[bytes, bool, tuple[str, int] | None], None]
"""Takes bytes as they pass, whether we sent them, and our end of the connection."""


class DashboardHandler(Protocol):
    """The user of the client; called from its task. Must not raise."""

    def connected(self) -> None:
        """The server has greeted: commands can be given."""

    def state_read(self, state: RobotState) -> None:
        """A round of questions was answered."""

    def answered(self, request: DashboardRequest, reply: DashboardReply) -> None:
        """What became of a command."""

    def lost(self, reason: str, *, was_connected: bool) -> None:
        """There is no connection, for this reason; another one will be tried for."""


class _LostError(Exception):
    """The connection is of no use any more; the text says why."""


class DashboardClient:
    """The dashboard server of one controller, for as long as `run` runs. `period`: seconds between two rounds."""

    def __init__(self, host: str, port: int, period: float, handler: DashboardHandler) -> None:
        self.progress = 0
        """Moves several times a second while `run` works, whatever the server does."""
        self.connections = 0
        """Connections since the start that were greeted."""
        self._host, self._port, self._period = host, port, period
        self._handler = handler
        self._line: _Line | None = None
        self._next: DashboardRequest | None = None
        self._next_at = 0.0
        self._is_sent = False
        self._expiry: asyncio.TimerHandle | None = None
        self._given = asyncio.Event()
        self._again = False
        self._tap: StreamTap | None = None

    @property
    def is_connected(self) -> bool:
        """Whether commands can be given."""
        return self._line is not None

    @property
    def is_busy(self) -> bool:
        """Whether a command is under way."""
        return self._next is not None

    def give(self, request: DashboardRequest) -> bool:
        """Give a command at once; False: it was not given, there is no connection, or another one is under way."""
        if self._line is None or self._next is not None:
            return False
        self._next, self._next_at, self._is_sent = request, clock.now(), False
        self._given.set()
        self._expiry = asyncio.get_running_loop().call_later(SENT_WITHIN, self._expire)
        return True

    def trace(self, tap: StreamTap | None) -> None:
        """Hand `tap` what passes from now on; None: nobody traces any more."""
        self._tap = tap

    async def run(self) -> None:
        """Stay connected until cancelled."""
        delay = _RETRY
        while True:
            was_connected, self._again = False, False
            line = _Line(self._passed)
            try:
                await self._connect(line)
                was_connected, self._line, delay = True, line, _RETRY
                self.connections += 1
                self._handler.connected()
                await self._serve(line)
            except (_LostError, OSError) as error:
                reason = error.args[0] if isinstance(error, _LostError) else _failure(error)
                self._end(str(reason), was_connected=was_connected)
            finally:
                self._line = None
                self._no_expiry()
                line.abort()
            if not self._again:
                await self._wait(asyncio.sleep(delay), delay)
                delay = delay if was_connected else min(2 * delay, _MAX_RETRY)

    # -- inside --------------------------------------------------------------------------------------------------

    async def _connect(self, line: _Line) -> None:
        try:
            async with asyncio.timeout(CONNECT_WITHIN):
                await self._wait(connect(lambda: line, self._host, self._port, _DEAD_PEER), CONNECT_WITHIN)
        except TimeoutError:
            raise _LostError("no answer: is the robot powered, and is the address right?") from None
        await self._read(line, GREETED_WITHIN, "it did not greet")

    async def _serve(self, line: _Line) -> None:
        asked, was_local = Round(), False
        while True:
            words: dict[StateQuestion, str | None] = {}
            for question in asked.questions:
                await self._obey(line)
                answer = await self._exchange(line, question.value, ANSWERED_WITHIN)
                words[question] = asked.answered(question, answer)
            # A controller that knows none of the questions is commanded all the same.
            await self._obey(line)
            state = asked.state(words)
            self._handler.state_read(state)
            if was_local and state.remote:
                # A connection from local control goes on to be refused: the robot itself asks for another one.
                self._again = True
                raise _LostError("the robot is in remote control now, which takes another connection")
            was_local = state.remote is False
            await self._rest(line)

    async def _rest(self, line: _Line) -> None:
        """Until the next round, or a command, or the end of the connection."""
        given, ended = asyncio.ensure_future(self._given.wait()), asyncio.ensure_future(line.ended.wait())
        try:
            await self._wait(
                asyncio.wait((given, ended), timeout=self._period, return_when=asyncio.FIRST_COMPLETED),
                self._period,
            )
        finally:
            given.cancel()
            ended.cancel()
        line.check()

    async def _obey(self, line: _Line) -> None:
        """Send the command that was given, and wait for its answer."""
        request = self._next
        if request is None:
            return
        self._given.clear()
        if clock.now() - self._next_at > SENT_WITHIN:
            self._expire()
            return
        line.check()
        self._is_sent = True
        answer = await self._exchange(line, request.line, request.patience)
        self._answered(request, reply_to(request.command, answer))

    def _expire(self) -> None:
        """The answer to a question has kept a command waiting for too long: its giver need not wait for both."""
        if self._next is not None and not self._is_sent:
            self._given.clear()
            self._answered(self._next, DashboardReply(CommandOutcome.NOT_SENT, ""))

    def _no_expiry(self) -> None:
        if self._expiry is not None:
            self._expiry.cancel()

    def _answered(self, request: DashboardRequest, reply: DashboardReply) -> None:
        self._next = None
        self._no_expiry()
        self._handler.answered(request, reply)

    async def _exchange(self, line: _Line, text: str, limit: float) -> str:
        line.check()
        line.send(text)
        return await self._read(line, limit, f"no answer to `{text}`")

    async def _read(self, line: _Line, limit: float, otherwise: str) -> str:
        try:
            async with asyncio.timeout(limit):
                return await self._wait(line.read(), limit)
        except TimeoutError:
            message = f"{otherwise} within {limit:g} s"
            raise _LostError(message) from None

    async def _wait(self, work: Awaitable[_Result], limit: float) -> _Result:
        return await wait_with_progress(work, self._moved, limit)

    def _moved(self) -> None:
        self.progress += 1

    def _end(self, reason: str, *, was_connected: bool) -> None:
        self._line = None
        self._given.clear()
        if self._next is not None:
            outcome = CommandOutcome.UNANSWERED if self._is_sent else CommandOutcome.NOT_SENT
            self._answered(self._next, DashboardReply(outcome, ""))
        self._handler.lost(reason, was_connected=was_connected)

    def _passed(self, data: bytes, outgoing: bool, own: tuple[str, int] | None) -> None:
        if self._tap is not None:
            self._tap(data, outgoing, own)


class _Line(asyncio.Protocol):
    """The socket of one connection."""

    def __init__(self, tap: StreamTap) -> None:
        self.ended = asyncio.Event()
        """Set when nothing more will come, or what came cannot be used."""
        self._dialogue = Dialogue()
        self._tap = tap
        self._reason = ""
        self._answer: str | None = None
        self._arrived = asyncio.Event()
        self._transport: asyncio.Transport | None = None
        self._own: tuple[str, int] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._own = tuple(transport.get_extra_info("sockname")[:2])

    def data_received(self, data: bytes) -> None:
        self._tap(data, False, self._own)
        try:
            self._answer = self._dialogue.receive(data)
        except DialogueError as error:
            self._fail(f"the other side is no dashboard server: it {error}")
            self.abort()
            return
        if self._answer is not None:
            self._arrived.set()

    def connection_lost(self, exc: Exception | None) -> None:
        self._fail(_failure(exc) if isinstance(exc, OSError) else "connection closed by the controller")

    def check(self) -> None:
        """Raise _LostError if it has ended."""
        if self.ended.is_set():
            raise _LostError(self._reason)

    def send(self, text: str) -> None:
        """Ask for something."""
        assert self._transport is not None
        self._arrived.clear()
        data = self._dialogue.ask(text)
        self._tap(data, True, self._own)
        self._transport.write(data)

    async def read(self) -> str:
        """The line that is due. Raises _LostError."""
        await self._arrived.wait()
        if self._answer is None:
            self.check()
        assert self._answer is not None
        answer, self._answer = self._answer, None
        return answer

    def abort(self) -> None:
        """Cut the connection."""
        if self._transport is not None:
            self._transport.abort()

    def _fail(self, reason: str) -> None:
        self._reason = self._reason or reason
        self.ended.set()
        self._arrived.set()


_FAILURES: Final = {
    errno.ECONNREFUSED: "connection refused: the robot is booting, or its dashboard server is off "
    "(Settings > Security > Services)",
    errno.EHOSTUNREACH: "no route to the robot: check cable, address and switch",
    errno.ENETUNREACH: "network unreachable: check this machine's address and gateway",
    errno.ETIMEDOUT: "the controller no longer answers: cable or power lost",
    errno.ECONNRESET: "connection reset by the controller",
    errno.EPIPE: "connection closed by the controller",
}


def _failure(error: OSError) -> str:
    """Why there is no connection, with the remedy as far as it is known."""
    if isinstance(error, socket.gaierror):
        return f"host name not known: {error.strerror}"
    return _FAILURES.get(error.errno or 0) or error.strerror or str(error)
