"""The client against the simulator's server, and against one that misbehaves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress

import pytest

from gatewayd.dashboard import client as module
from gatewayd.dashboard.client import DashboardClient
from gatewayd.dashboard.replies import CommandOutcome, DashboardReply
from gatewayd.dashboard.requests import DashboardRequest, Verb
from gatewayd.dashboard.state import RobotState
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard import PolyScope
from gatewayd.simulator.dashboard_server import DashboardServer

PLAY, STOP = DashboardRequest(Verb.PLAY), DashboardRequest(Verb.STOP)


class Notes:
    """A handler that writes everything down."""

    def __init__(self) -> None:
        self.states: list[RobotState] = []
        self.replies: list[tuple[DashboardRequest, DashboardReply]] = []
        self.losses: list[str] = []
        self.connections = 0
        self._changed = asyncio.Event()

    def connected(self) -> None:
        self.connections += 1
        self._changed.set()

    def state_read(self, state: RobotState) -> None:
        self.states.append(state)
        self._changed.set()

    def answered(self, request: DashboardRequest, reply: DashboardReply) -> None:
        self.replies.append((request, reply))
        self._changed.set()

    def lost(self, reason: str, *, was_connected: bool) -> None:
        self.losses.append(reason)
        self._changed.set()

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until it is so."""
        async with asyncio.timeout(10):
            while not condition():
                self._changed.clear()
                await self._changed.wait()


@asynccontextmanager
async def running(port: int, period: float = 0.02) -> AsyncIterator[tuple[DashboardClient, Notes]]:
    """A client at work."""
    notes = Notes()
    client = DashboardClient("127.0.0.1", port, period, notes)
    work = asyncio.create_task(client.run())
    try:
        yield client, notes
    finally:
        work.cancel()
        with suppress(asyncio.CancelledError):
            await work


@asynccontextmanager
async def simulated() -> AsyncIterator[DashboardServer]:
    """A simulated controller's server."""
    server = DashboardServer(PolyScope(Controller()))
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


async def heard(server: DashboardServer, line: str) -> None:
    """Wait until a client has said this."""
    async with asyncio.timeout(5):
        while line not in server.heard:  # noqa: ASYNC110 - the server tells nobody
            await asyncio.sleep(0.01)


@asynccontextmanager
async def scripted(say: Callable[[str], bytes], greeting: bytes = b"Connected\n") -> AsyncIterator[int]:
    """A server that answers as the test says; empty: not at all."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(greeting)
        with suppress(ConnectionError):
            while line := await reader.readline():
                writer.write(say(line.decode().strip()))
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    async with server:
        yield server.sockets[0].getsockname()[1]


def quiet(line: str) -> bytes:
    """Answers to questions alone."""
    return {
        "robotmode": b"Robotmode: RUNNING\n",
        "programState": b"STOPPED x.urp\n",
        "get loaded program": b"No program loaded\n",
        "safetystatus": b"Safetystatus: NORMAL\n",
        "is in remote control": b"true\n",
    }.get(line, b"")


async def test_it_asks_and_commands_on_one_connection() -> None:
    async with simulated() as server, running(server.port) as (client, notes):
        await notes.until(lambda: bool(notes.states))
        assert notes.states[-1] == RobotState("RUNNING", "PLAYING", "/programs/pick.urp", "NORMAL", True)
        assert client.give(STOP)
        assert not client.give(PLAY), "one at a time"
        await notes.until(lambda: bool(notes.replies))
        assert notes.replies == [(STOP, DashboardReply(CommandOutcome.DONE, "Stopped"))]
        assert server.heard.count("stop") == 1
        assert client.connections == 1


async def test_without_a_connection_nothing_is_given() -> None:
    async with running(1) as (client, notes):
        await notes.until(lambda: bool(notes.losses))
        assert "refused" in notes.losses[0]
        assert not client.give(PLAY)


async def test_it_comes_again_and_gives_nothing_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_RETRY", 0.01)
    async with simulated() as server, running(server.port) as (client, notes):
        await notes.until(lambda: bool(notes.states))
        server.silent = True
        assert client.give(STOP)
        await heard(server, "stop")
        server.silent = False
        server.drop_clients()
        await notes.until(lambda: notes.connections == 2)
        assert [reply.outcome for _request, reply in notes.replies] == [CommandOutcome.UNANSWERED]
        seen = len(notes.states)
        await notes.until(lambda: len(notes.states) > seen)
        assert server.heard.count("stop") == 1


async def test_a_command_that_would_come_late_is_not_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SENT_WITHIN", -1.0)
    async with simulated() as server, running(server.port) as (client, notes):
        await notes.until(lambda: bool(notes.states))
        assert client.give(STOP)
        await notes.until(lambda: bool(notes.replies))
        assert notes.replies[0][1].outcome is CommandOutcome.NOT_SENT
        assert "stop" not in server.heard


async def test_a_command_that_a_slow_answer_keeps_waiting_is_refused_before_the_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "SENT_WITHIN", 0.02)
    async with simulated() as server, running(server.port) as (client, notes):
        await notes.until(lambda: bool(notes.states))
        server.silent = True
        asked = len(server.heard)
        async with asyncio.timeout(5):
            while len(server.heard) == asked:  # noqa: ASYNC110 - the server tells nobody
                await asyncio.sleep(0.005)
        assert client.give(STOP)
        await notes.until(lambda: bool(notes.replies))
        assert notes.replies[0][1].outcome is CommandOutcome.NOT_SENT
        assert client.is_connected, "the question is still open"
        assert not client.is_busy
        assert "stop" not in server.heard


async def test_a_server_that_knows_no_question_is_commanded_at_once() -> None:
    def say(line: str) -> bytes:
        return b"Starting program\n" if line == "play" else f"could not understand: '{line}'\n".encode()

    async with scripted(say) as port, running(port) as (client, notes):
        await notes.until(lambda: len(notes.states) > 2)  # the third round has no question left
        assert client.give(PLAY)
        await notes.until(lambda: bool(notes.replies))
        assert notes.replies[0][1].outcome is CommandOutcome.DONE
        rounds = len(notes.states)
        await notes.until(lambda: len(notes.states) > rounds)
        assert not client.is_busy


async def test_silence_ends_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ANSWERED_WITHIN", 0.05)
    async with scripted(lambda _: b"") as port, running(port) as (client, notes):
        await notes.until(lambda: bool(notes.losses))
        assert notes.losses[0] == "no answer to `robotmode` within 0.05 s"
        assert client.progress > 0


@pytest.mark.parametrize(
    "greeting, why",
    [
        (b"SSH-2.0-x\nmore\n", "two answers"),
        (b"x" * 2000, "1024 bytes"),
        (bytes(range(256)), "no answer|two answers"),
    ],
)
async def test_another_server_is_none(greeting: bytes, why: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ANSWERED_WITHIN", 0.05)
    async with scripted(lambda _: b"", greeting) as port, running(port) as (_client, notes):
        await notes.until(lambda: bool(notes.losses))
        assert any(word in notes.losses[0] for word in why.split("|"))


async def test_an_answer_too_many_ends_the_connection() -> None:
    say = {"play": b"Starting program\nStopped\n"}
    async with scripted(lambda line: say.get(line) or quiet(line)) as port, running(port) as (client, notes):
        await notes.until(lambda: bool(notes.states))
        client.give(PLAY)
        await notes.until(lambda: bool(notes.losses))
        assert "two answers" in notes.losses[0]
        assert notes.replies[0][1].outcome is CommandOutcome.UNANSWERED


async def test_remote_control_takes_another_connection() -> None:
    async with simulated() as server, running(server.port) as (client, notes):
        server.polyscope.remote = False
        server.drop_clients()
        await notes.until(lambda: bool(notes.states) and notes.states[-1].remote is False)
        client.give(STOP)
        await notes.until(lambda: bool(notes.replies))
        assert notes.replies[0][1].outcome is CommandOutcome.LOCAL
        before = notes.connections
        server.polyscope.remote = True
        await notes.until(lambda: notes.connections > before)
        assert client.give(STOP)
        await notes.until(lambda: len(notes.replies) == 2)
        assert notes.replies[1][1].outcome is CommandOutcome.DONE


async def test_a_tap_sees_both_directions() -> None:
    passed: list[tuple[bytes, bool]] = []
    async with simulated() as server, running(server.port) as (client, notes):
        client.trace(lambda data, outgoing, _own: passed.append((data, outgoing)))
        await notes.until(lambda: len(notes.states) > 1)
    assert (b"robotmode\n", True) in passed
    assert (b"Robotmode: RUNNING\n", False) in passed
