"""A small scripted controller on a real loopback socket, and a handler that writes down what it is told."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

import pytest

from gatewayd.rtde import client, messages
from gatewayd.rtde.codec import ControllerProtocol
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.loss import Loss
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.session import ClientSettings, Session
from gatewayd.rtde.strange import StrangePackage
from gatewayd.rtde.types import DataType

Connected = Callable[..., AbstractAsyncContextManager[tuple[client.RtdeClient, "Notebook"]]]
"""Run a client with these settings against the controller for as long as the `async with` lasts."""

E_SERIES = messages.ControllerVersion(5, 12, 0, 1101)


@dataclass
class Script:
    """How the controller behaves; tests change it while it runs."""

    version: messages.ControllerVersion = E_SERIES
    protocols: frozenset[int] = frozenset({1, 2})
    base_rate: int = 500
    in_use: set[str] = field(default_factory=set)
    missing: set[str] = field(default_factory=set)
    texts: bool = False
    """Send a text at connect and after every answer."""
    mute: set[type] = field(default_factory=set)
    """Requests that are not answered."""
    accept_start: bool = True
    data_before_start_reply: bool = False
    package_before_inputs_reply: bool = False
    sends_data: bool = True
    time_zero: float = 100.0
    claimable: set[str] = field(default_factory=set)
    """Inputs that can be claimed although they are missing."""
    name_limit: int = 65535
    complains: bool = False
    """Say so where a list is longer than that."""
    stop_reading: bool = False
    spoil: Callable[[bytes], bytes] | None = None
    """Applied to every package sent."""
    spoiled: float = 0.0
    """Share of packages to spoil, for `spoil`."""


class Peer:
    """One connection at the controller's end."""

    def __init__(self, script: Script, writer: asyncio.StreamWriter) -> None:
        self.script = script
        self.writer = writer
        self.protocol = ControllerProtocol()
        self.received: list[messages.ExecutableMessage] = []
        self.recipes: dict[int, Recipe] = {}
        self.written: dict[str, Scalar] = {}
        self.outputs: Recipe | None = None
        self.frequency = 0.0
        self.streaming: asyncio.Task[None] | None = None
        self.step = 0

    def say(self, message: messages.ControllerMessage) -> None:
        package = self.protocol.send(message)
        self.writer.write(self.script.spoil(package) if self.script.spoil is not None else package)

    def text(self, words: str = "SafetySetup has not been confirmed yet") -> None:
        self.say(messages.TextMessage(words, "URControl", messages.TextLevel.WARNING))

    def answer(self, message: messages.ExecutableMessage) -> None:
        self.received.append(message)
        if type(message) in self.script.mute:
            return
        match message:
            case messages.RequestProtocolVersion(version):
                self.say(messages.ProtocolVersionReply(version in self.script.protocols))
            case messages.GetControllerVersion():
                self.say(self.script.version)
            case messages.SetupOutputs(names, frequency):
                self.setup_outputs(names, frequency)
            case messages.SetupInputs(names):
                self.setup_inputs(names)
            case messages.Start():
                self.start()
            case messages.Pause():
                self.stop()
                self.say(messages.PauseReply(True))
            case messages.DataPackage(recipe, payload):
                assert recipe is not None
                layout = self.recipes[recipe]
                self.written.update(zip(layout.names, layout.unpack(payload), strict=True))
            case _:
                pass
        if self.script.texts and not isinstance(message, messages.DataPackage):
            self.text()

    def setup_outputs(self, names: tuple[str, ...], frequency: float | None) -> None:
        if self.is_too_long(names):
            return
        words = tuple(
            "NOT_FOUND" if name in self.script.missing or name not in OUTPUTS else OUTPUTS[name].type.word
            for name in names
        )
        good = "NOT_FOUND" not in words
        if good:
            self.outputs = Recipe(names, [DataType.from_word(word) for word in words])
            self.frequency = frequency or 125.0
        self.say(messages.OutputsSetup(int(good), words))

    def setup_inputs(self, names: tuple[str, ...]) -> None:
        if self.is_too_long(names):
            return
        words = tuple(self.input_word(name) for name in names)
        good = not messages.ERROR_WORDS.intersection(words)
        number = 0
        if good:
            number = len(self.recipes) + 1
            self.recipes[number] = Recipe(names, [DataType.from_word(word) for word in words])
        if self.script.package_before_inputs_reply:
            self.package()
        self.say(messages.InputsSetup(number, words))

    def is_too_long(self, names: tuple[str, ...]) -> bool:
        too_long = len(",".join(names)) > self.script.name_limit
        if too_long and self.script.complains:
            self.say(messages.TextMessage("the list is too long", "URControl", messages.TextLevel.ERROR))
        return too_long

    def input_word(self, name: str) -> str:
        if name in self.script.missing - self.script.claimable or name not in INPUTS:
            return "NOT_FOUND"
        return "IN_USE" if name in self.script.in_use else INPUTS[name].type.word

    def start(self) -> None:
        if self.script.accept_start and self.script.data_before_start_reply:
            self.package()
        self.say(messages.StartReply(self.script.accept_start))
        if self.script.accept_start and self.script.sends_data:
            self.streaming = asyncio.create_task(self.stream())

    def stop(self) -> None:
        if self.streaming is not None:
            self.streaming.cancel()
            self.streaming = None

    @property
    def period(self) -> float:
        return math.floor(self.script.base_rate / self.frequency) / self.script.base_rate

    def package(self, steps: int = 1) -> None:
        assert self.outputs is not None
        self.step += steps
        values: list[Scalar] = []
        for name, kind in zip(self.outputs.names, self.outputs.types, strict=True):
            value = self.written.get(name, self.step if kind is DataType.INT32 else 0)
            values += [self.script.time_zero + self.step * self.period if name == "timestamp" else value] * (
                kind.count
            )
        self.say(messages.DataPackage(1, self.outputs.pack(values)))

    async def stream(self) -> None:
        while True:
            self.package()
            await asyncio.sleep(self.period)


class Controller:
    """Listens on a free loopback port and follows its script."""

    def __init__(self) -> None:
        self.script = Script()
        self.peers: list[Peer] = []
        self.port = 0
        self._server: asyncio.Server | None = None
        self._shutting = asyncio.Event()

    @property
    def peer(self) -> Peer:
        return self.peers[-1]

    async def listen(self) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def shut(self) -> None:
        self._shutting.set()
        if self._server is not None:
            self._server.close()
            self._server = None
        for peer in self.peers:
            peer.stop()
            peer.writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer = Peer(self.script, writer)
        self.peers.append(peer)
        if self.script.texts:
            peer.text()
        with suppress(ConnectionError):
            while data := await reader.read(65536):
                for message in peer.protocol.receive(data):
                    assert not isinstance(message, StrangePackage)
                    peer.answer(message)
                if self.script.stop_reading:
                    await self._shutting.wait()
        peer.stop()
        writer.close()


class Notebook:
    """A handler that keeps what it is told."""

    def __init__(self) -> None:
        self.sessions: list[Session] = []
        self.changes: list[Session] = []
        self.losses: list[Loss] = []
        self.texts: list[messages.TextMessage] = []
        self.delays: list[float] = []
        self.strange_packages: list[StrangePackage] = []
        self.packages: list[tuple[Scalar, ...]] = []
        self.earlier_packages: list[tuple[Scalar, ...]] = []
        self.takes_earlier = True
        self.calls: list[str] = []
        """Names of the calls about sessions, packages and inputs, in their order."""
        self.client: client.RtdeClient | None = None

    def session_started(self, session: Session) -> None:
        self.sessions.append(session)
        self.calls.append("session_started")

    def values(self, values: tuple[Scalar, ...], now: float) -> None:
        assert now > 0
        self.packages.append(values)
        self.calls.append("values")

    def earlier(self, values: tuple[Scalar, ...], now: float) -> bool:
        assert now > 0
        self.earlier_packages.append(values)
        return self.takes_earlier

    def inputs_changed(self, session: Session) -> None:
        self.changes.append(session)
        self.calls.append("inputs_changed")

    def session_lost(self, loss: Loss) -> None:
        self.losses.append(loss)
        self.calls.append("session_lost")

    def text(self, message: messages.TextMessage) -> None:
        self.texts.append(message)

    def strange(self, package: StrangePackage) -> None:
        self.strange_packages.append(package)

    def probed(self, delay: float) -> None:
        self.delays.append(delay)


def send(one: client.RtdeClient, key: str, values: Sequence[Scalar]) -> bool:
    """Send by the newest recipe of that key, if there is one."""
    recipe = one.session.inputs.get(key) if one.session is not None else None
    return recipe is not None and one.send(recipe, values)


async def _until(condition: Callable[[], object], seconds: float = 5.0) -> None:
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0.002)


@pytest.fixture
def until() -> Callable[..., Awaitable[None]]:
    """Wait until a condition holds, five seconds at most."""
    return _until


@pytest.fixture
async def controller() -> AsyncIterator[Controller]:
    """A controller that listens."""
    one = Controller()
    await one.listen()
    yield one
    await one.shut()


@pytest.fixture
def connected(controller: Controller) -> Connected:
    """Run a client against the controller for as long as the `async with` lasts."""

    @asynccontextmanager
    async def run(**settings: Any) -> AsyncIterator[tuple[client.RtdeClient, Notebook]]:
        notebook = Notebook()
        wanted = ClientSettings(**{"host": "127.0.0.1", "port": controller.port, **settings})
        one = client.RtdeClient(wanted, notebook)
        task = asyncio.create_task(one.run())
        try:
            yield one, notebook
        finally:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    return run
