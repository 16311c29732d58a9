"""RTDE packages to messages and back, for both sides, without any IO (guide, section "Header").

A package is `uint16 size, uint8 type, payload`, size including these three bytes, everything big-endian. A connection
speaks protocol version 1 until the controller has accepted another one.
"""

from __future__ import annotations

import struct
from collections import deque
from typing import TYPE_CHECKING, Generic, NoReturn, TypeVar, cast

from gatewayd.rtde import payloads
from gatewayd.rtde.messages import (
    ControllerMessage,
    DataPackage,
    ExecutableMessage,
    PackageType,
    ProtocolVersionReply,
    RequestProtocolVersion,
)
from gatewayd.rtde.strange import Oddity, StrangePackage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

MAX_PACKAGE = 0xFFFF
"""Largest package, header included: what its size field can say."""

_HEADER = struct.Struct(">HB")
_DATA = int(PackageType.DATA_PACKAGE)
_SHOWN = 16
_MOST_REQUESTS = 16


class ProtocolError(Exception):
    """Bytes that cannot be cut into packages, or values that are not of their recipe: what was wrong, and where."""

    def __init__(self, reason: str, offset: int, data: bytes = b"", *, within: str = "stream") -> None:
        shown = data[:_SHOWN].hex(" ") + (" ..." if len(data) > _SHOWN else "")
        super().__init__(f"{reason}, at byte {offset} of the {within}" + (f": {shown}" if shown else ""))
        self.reason = reason
        """What was wrong, without the place."""
        self.offset = offset
        """First byte of the offending package in the stream received; of the offending value in a payload."""
        self.data = data
        """The offending bytes, as far as they had arrived."""


_Received = TypeVar("_Received", ControllerMessage, ExecutableMessage)
_Sent = TypeVar("_Sent", ControllerMessage, ExecutableMessage)


class _Endpoint(Generic[_Received, _Sent]):
    """One side of a connection: what comes is cut into packages and decoded, by the table of the version spoken.

    `decoders` are the tables of versions 1 and 2, `ids_since` the version from which received data has a recipe id.
    """

    def __init__(
        self,
        decoders: tuple[Mapping[int, Callable[[bytes], _Received]], ...],
        encode: Callable[[_Sent, int], tuple[PackageType, bytes]],
        ids_since: int,
    ) -> None:
        self._tables: tuple[Mapping[int, Callable[[bytes], _Received]], ...] = decoders
        self._encode: Callable[[_Sent, int], tuple[PackageType, bytes]] = encode
        self._ids_since = ids_since
        self._speak(1)
        self._rest = bytearray()
        self._needed = _HEADER.size
        self._consumed = 0
        self._error: ProtocolError | None = None
        self._requested: deque[int] = deque(maxlen=_MOST_REQUESTS)

    @property
    def buffered(self) -> int:
        """Bytes kept for an unfinished package: always less than MAX_PACKAGE once an iterator is exhausted."""
        return len(self._rest)

    @property
    def unfinished(self) -> str:
        """What is kept for an unfinished package, for people; empty if nothing is."""
        if len(self._rest) < _HEADER.size:
            return ""
        size, kind = _HEADER.unpack_from(self._rest)
        known = PackageType(kind).name if kind in self._decoders else f"unknown type {kind}"
        return f"{len(self._rest)} of {size} bytes of {known}: {bytes(self._rest[:_SHOWN]).hex(' ')}"

    def receive(self, data: bytes) -> Iterator[_Received | StrangePackage]:
        """The messages that `data` completes, in order; a package that is odd, whatever it is, comes as strange.

        Exhaust the iterator before the next call. A message is decoded when it is asked for, so that an answer sent
        while iterating (an accepted protocol version) already governs the next one. A strange package that can be read
        all the same is followed by its message. Raises ProtocolError where a header cannot be one, because the stream
        is cut wrongly then; from then on every call raises it again and takes nothing in.
        """
        if self._error is not None:
            raise self._error
        rest = self._rest
        if rest:
            rest += data
            if len(rest) < self._needed:
                return iter(())
            data = bytes(rest)
            rest.clear()
        return self._messages(data)

    def data_header(self, recipe: int, size: int) -> bytes:
        """What a data package with an id and `size` bytes of values begins with."""
        return _HEADER.pack(_HEADER.size + 1 + size, _DATA) + bytes((recipe,))

    def skip(self, size: int) -> None:
        """So many bytes, whole packages, were received and taken by somebody else."""
        self._consumed += size

    def _messages(self, data: bytes) -> Iterator[_Received | StrangePackage]:
        position = 0
        end = len(data)
        self._needed = _HEADER.size
        try:
            while end - position >= _HEADER.size:
                size, kind = _HEADER.unpack_from(data, position)
                if size < _HEADER.size:
                    self._reject(size, position, data[position : position + _HEADER.size])
                if end - position < size:
                    self._needed = size
                    break
                start = position
                position += size
                if kind == _DATA and self._data_id and size > _HEADER.size:
                    yield DataPackage(data[start + 3], data[start + 4 : position])
                    continue
                yield from self._decoded(kind, data[start:position])
        finally:
            if self._error is None:
                self._consumed += position
                self._rest += data[position:]

    def _decoded(self, kind: int, package: bytes) -> Iterator[_Received | StrangePackage]:
        decoder = self._decoders.get(kind)
        if decoder is None:
            yield StrangePackage(Oddity.UNKNOWN_TYPE, kind, f"unknown package type {kind}", package[:_SHOWN])
            return
        try:
            message = decoder(package[_HEADER.size :])
        except payloads.MalformedPayloadError as error:
            reason = f"{PackageType(kind).name} with {error}"
            yield StrangePackage(Oddity.LAYOUT, kind, reason, package[:_SHOWN])
            if error.read_as is None:
                return
            message = cast("_Received", error.read_as)
        self._note(message)
        yield message

    def send(self, message: _Sent) -> bytes:
        """The package of `message` in the version spoken. ValueError for what does not fit into one."""
        kind, payload = self._encode(message, self.version)
        size = _HEADER.size + len(payload)
        if size > MAX_PACKAGE:
            msg = f"{kind.name} of {size} bytes is larger than a package can be ({MAX_PACKAGE})"
            raise ValueError(msg)
        if kind is not PackageType.DATA_PACKAGE:
            self._note(message)
        return _HEADER.pack(size, kind) + payload

    def _note(self, message: ControllerMessage | ExecutableMessage) -> None:
        """Switch the version where a message, sent or received, accepts the one that was requested first."""
        if isinstance(message, RequestProtocolVersion):
            self._requested.append(message.version)
        elif isinstance(message, ProtocolVersionReply) and self._requested:
            requested = self._requested.popleft()
            if message.accepted:
                self._speak(requested)

    def _speak(self, version: int) -> None:
        self.version = version
        """Protocol version spoken: 1 until another one is accepted."""
        self._decoders: Mapping[int, Callable[[bytes], _Received]] = self._tables[version > 1]
        self._data_id = version >= self._ids_since

    def _reject(self, size: int, position: int, header: bytes) -> NoReturn:
        reason = f"package size {size} is less than its own header of {_HEADER.size} bytes"
        self._error = ProtocolError(reason, self._consumed + position, header)
        raise self._error from None


class ClientProtocol(_Endpoint[ControllerMessage, ExecutableMessage]):
    """The client's side of one connection (EE). Switches version when an accepted request is answered."""

    def __init__(self) -> None:
        tables = payloads.FROM_CONTROLLER_V1, payloads.FROM_CONTROLLER
        super().__init__(tables, payloads.encode_executable, ids_since=2)


class ControllerProtocol(_Endpoint[ExecutableMessage, ControllerMessage]):
    """The controller's side of one connection (CON). Switches version when it sends the acceptance of a request.

    Answer a RequestProtocolVersion while iterating over `receive`, before the next message is taken.
    """

    def __init__(self) -> None:
        tables = payloads.FROM_EXECUTABLE_V1, payloads.FROM_EXECUTABLE
        super().__init__(tables, payloads.encode_controller, ids_since=1)
