"""A controller that does only what the benchmark tells it: no clock of its own, so every package has a known moment.

It accepts every field of the catalogue, sends a package when asked, and reports the input packages that arrive.
What clients write is read back, as a real controller does it.
"""

from __future__ import annotations

import selectors
import socket
import time
from collections.abc import Sequence

from gatewayd.rtde.codec import ControllerProtocol
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.messages import (
    ControllerMessage,
    ControllerVersion,
    DataPackage,
    ExecutableMessage,
    GetControllerVersion,
    InputsSetup,
    OutputsSetup,
    Pause,
    PauseReply,
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

VERSION = ControllerVersion(5, 23, 0, 0)
Values = dict[str, tuple[Scalar, ...]]


def _type_of(name: str) -> DataType:
    return (OUTPUTS.get(name) or INPUTS[name]).type


class Session:
    """One client's connection."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.protocol = ControllerProtocol()
        self.output: Recipe | None = None
        self.inputs: list[Recipe] = []
        self.started = False

    def take(self, data: bytes) -> list[Values]:
        """Answer what the client asks; the values of its data packages."""
        return [values for message in self.protocol.receive(data) for values in self._handle(message)]

    def _handle(self, message: ExecutableMessage | StrangePackage) -> list[Values]:
        assert not isinstance(message, StrangePackage)
        if isinstance(message, DataPackage):
            recipe = self.inputs[(message.recipe or 1) - 1]
            values = recipe.unpack(message.payload)
            return [{name: values[recipe.slots[name]] for name in recipe.names}]
        reply = self._reply(message)
        if reply is not None:
            self.connection.sendall(self.protocol.send(reply))
        return []

    def _reply(self, message: ExecutableMessage) -> ControllerMessage | None:
        match message:
            case RequestProtocolVersion(version):
                return ProtocolVersionReply(version <= 2)
            case GetControllerVersion():
                return VERSION
            case SetupOutputs(names):
                self.output = Recipe(names, [_type_of(name) for name in names])
                return OutputsSetup(1, tuple(kind.word for kind in self.output.types))
            case SetupInputs(names):
                self.inputs.append(Recipe(names, [_type_of(name) for name in names]))
                return InputsSetup(len(self.inputs), tuple(kind.word for kind in self.inputs[-1].types))
            case Start():
                self.started = True
                return StartReply(True)
            case Pause():
                self.started = False
                return PauseReply(True)
        return None


class Controller:
    """Listens on one port; everything happens in `pump` and `send`, in the caller's thread."""

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        self.port = port
        self._listener = socket.create_server((host, port))
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._sessions: dict[socket.socket, Session] = {}
        self.values: Values = {}
        """What the next package carries; fields that are not named are zero."""
        self.sent = 0
        """Packages."""

    def pump(self, timeout: float) -> list[Values]:
        """Wait for anything to happen, at most `timeout` seconds; the input packages that it brought."""
        arrived: list[Values] = []
        for key, _ in self._selector.select(timeout):
            if key.fileobj is self._listener:
                self._accept()
                continue
            connection = key.fileobj
            assert isinstance(connection, socket.socket)
            try:
                data = connection.recv(65536)
            except ConnectionResetError:
                data = b""
            if data:
                arrived += self._sessions[connection].take(data)
            else:
                self._selector.unregister(connection)
                del self._sessions[connection]
        for values in arrived:
            self.values.update(values)
        return arrived

    def wait_for_start(self, sessions: int = 1, limit: float = 15.0) -> None:
        """Serve until so many clients have started their output; TimeoutError after `limit` seconds."""
        end = time.monotonic() + limit
        while sum(session.started for session in self._sessions.values()) < sessions:
            if time.monotonic() > end:
                raise TimeoutError("no client has started its output")
            self.pump(0.01)

    def send(self) -> None:
        """One package to every client that has started, stamped with the present moment."""
        self.burst([{}], 0.0)

    def burst(self, packages: Sequence[Values], period: float) -> None:
        """Packages to every client that has started, in one segment; stamped `period` apart, the last one now.

        Each changes `values` before it is made.
        """
        first = time.monotonic() - (len(packages) - 1) * period
        segments = dict.fromkeys(self._sessions.values(), b"")
        for place, values in enumerate(packages):
            self.values.update(values, timestamp=(first + place * period,))
            for session in segments:
                if session.started and session.output is not None:
                    package = DataPackage(1, self._packed(session.output))
                    segments[session] += session.protocol.send(package)
        for session, segment in segments.items():
            session.connection.sendall(segment)
        self.sent += len(packages)

    def close(self) -> None:
        """Drop all clients."""
        for connection in (*self._sessions, self._listener):
            connection.close()
        self._selector.close()

    def _accept(self) -> None:
        connection, _ = self._listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._selector.register(connection, selectors.EVENT_READ)
        self._sessions[connection] = Session(connection)

    def _packed(self, recipe: Recipe) -> bytes:
        flat: list[Scalar] = []
        for name, kind in zip(recipe.names, recipe.types, strict=True):
            flat += self.values.get(name, (0,) * kind.count)
        return recipe.pack(flat)
