"""A plain RTDE client for one message at a time, and simulators on free ports."""

from __future__ import annotations

import asyncio
import contextlib
import os
import subprocess
import sys
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from types import TracebackType
from typing import Self, TypeVar

import pytest

from gatewayd.rtde.codec import ClientProtocol
from gatewayd.rtde.messages import (
    ControllerMessage,
    DataPackage,
    ExecutableMessage,
    InputsSetup,
    OutputsSetup,
    ProtocolVersionReply,
    RequestProtocolVersion,
    SetupInputs,
    SetupOutputs,
    Start,
    StartReply,
)
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.strange import StrangePackage
from gatewayd.rtde.types import DataType
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.server import SimulatedController

Message = TypeVar("Message", bound=ControllerMessage)
PATIENCE = 10.0


class Client:
    """One connection; every wait is bounded."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.protocol = ClientProtocol()
        self.recipe: Recipe | None = None
        self._messages: deque[ControllerMessage] = deque()

    async def __aenter__(self) -> Self:
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.writer.close()

    def send(self, *messages: ExecutableMessage) -> None:
        self.writer.write(b"".join(map(self.protocol.send, messages)))

    async def receive(self, kind: type[Message]) -> Message:
        """The next message of that kind; others are dropped. EOFError when the connection has ended."""
        while True:
            while self._messages:
                message = self._messages.popleft()
                if isinstance(message, kind):
                    return message
            data = await asyncio.wait_for(self.reader.read(65536), PATIENCE)
            if not data:
                raise EOFError
            for received in self.protocol.receive(data):
                assert not isinstance(received, StrangePackage)
                self._messages.append(received)

    async def ended(self) -> None:
        """Returns when the controller has closed the connection; TimeoutError if it does not."""
        async with asyncio.timeout(PATIENCE):
            with contextlib.suppress(ConnectionError):
                while await self.reader.read(65536):
                    pass

    async def negotiate(self, version: int = 2) -> bool:
        self.send(RequestProtocolVersion(version))
        return (await self.receive(ProtocolVersionReply)).accepted

    async def outputs(self, *names: str, frequency: float | None = 0.0) -> OutputsSetup:
        self.send(SetupOutputs(names, frequency))
        reply = await self.receive(OutputsSetup)
        if reply.recipe != 0:
            self.recipe = Recipe(names, [DataType.from_word(word) for word in reply.types])
        return reply

    async def inputs(self, *names: str) -> InputsSetup:
        self.send(SetupInputs(names))
        return await self.receive(InputsSetup)

    async def stream(self, *names: str, frequency: float = 0.0) -> None:
        """Everything up to a running output recipe."""
        assert await self.negotiate()
        await self.outputs(*names, frequency=frequency)
        self.send(Start())
        assert (await self.receive(StartReply)).accepted

    async def package(self) -> tuple[Scalar, ...]:
        """The values of the next data package."""
        assert self.recipe is not None
        return self.recipe.unpack((await self.receive(DataPackage)).payload)

    async def until(self, condition: Callable[[tuple[Scalar, ...]], bool]) -> tuple[Scalar, ...]:
        """The first package that fulfils `condition`."""
        async with asyncio.timeout(PATIENCE):
            while not condition(values := await self.package()):
                pass
        return values


@pytest.fixture
async def simulator() -> AsyncIterator[SimulatedController]:
    """An e-Series controller without faults or program."""
    async with SimulatedController(Controller()) as served:
        yield served


class Process:
    """A `gatewayd simulate` process that takes commands."""

    def __init__(self, *options: str) -> None:
        command = [
            sys.executable,
            "-m",
            "gatewayd",
            "simulate",
            *(() if "--port" in options else ("--port", "0")),
            "--control",
            "stdin",
            "-q",
            *options,
        ]
        self.popen = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        assert self.popen.stdout is not None
        line = self.popen.stdout.readline()
        assert line.startswith("listening on 127."), line
        self.port = int(line.rsplit(":", 1)[1])

    def do(self, command: str) -> str:
        """One command line and its answer."""
        assert self.popen.stdin is not None
        assert self.popen.stdout is not None
        self.popen.stdin.write(command + "\n")
        self.popen.stdin.flush()
        return self.popen.stdout.readline().rstrip("\n")

    def stop(self) -> int:
        """End it and return its exit code."""
        self.popen.terminate()
        try:
            self.popen.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.communicate()
        return self.popen.returncode


@pytest.fixture
def process() -> Iterator[Callable[..., Process]]:
    """Starts `gatewayd simulate` processes and ends them after the test."""
    started: list[Process] = []

    def start(*options: str) -> Process:
        started.append(Process(*options))
        return started[-1]

    yield start
    for one in started:
        one.stop()


@pytest.fixture
def client() -> type[Client]:
    """The client class, for `async with client(port)`."""
    return Client
