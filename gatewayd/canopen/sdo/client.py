"""The SDO client: one transfer at a time with one server, frames in and frames out (CiA 301, 7.2.4).

The twin of `gatewayd.canopen.sdo.server`. What a frame does follows from the state of the transfer and from what the
frame says, by the table of `SdoClient`. Values go expedited or in segments, which every server has to know; block
transfers are not used.

A transfer that has timed out may be answered afterwards. Such an answer names an object, and is ignored where that is
not the object of the present transfer; the answer of a segment names none, and a wrong toggle bit ends the transfer.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from gatewayd.canopen.dictionary import Abort, AbortCode
from gatewayd.canopen.sdo import protocol
from gatewayd.canopen.sdo.protocol import ANSWERS, SdoAnswer
from gatewayd.canopen.sdo.transfers import Download, Upload

CLIENT_TIMEOUT = 1.0
"""Seconds without an answer after which a transfer has failed. Drives are known that take more than 100 ms."""
LONGEST_UPLOAD = 65_536
"""Bytes that a server may send as one value."""

_FRAME = 8
_MULTIPLEXER = struct.Struct("<HB")
_UNNAMED = b"\0\0\0"
_TOGGLE = 0x10


class SdoClientState(Enum):
    """What the client waits for."""

    IDLE = "a transfer"
    DOWNLOAD = "the confirmation of a download"
    DOWNLOAD_SEGMENT = "the confirmation of a segment"
    UPLOAD = "the value"
    UPLOAD_SEGMENT = "a segment of the value"


@dataclass(frozen=True, slots=True)
class SdoResult:
    """How a transfer has ended."""

    index: int
    subindex: int
    data: bytes = b""
    """What was uploaded; nothing after a download or a failure."""
    code: int | None = None
    """The abort code; None: it went well."""
    silent: bool = False
    """The server has not answered in time."""

    @property
    def good(self) -> bool:
        """Whether the value was read or written."""
        return self.code is None


Act = Callable[["SdoClient", bytes], list[bytes]]
"""Takes a frame and gives the requests that follow; raises Abort."""


class SdoClient:
    """One SDO channel. `upload` and `download` begin a transfer; its result is there for `take` when it has ended."""

    def __init__(self, timeout: float = CLIENT_TIMEOUT, longest: int = LONGEST_UPLOAD) -> None:
        """`timeout` in seconds, for each answer; `longest`: bytes that a value may have."""
        self._timeout = timeout
        self._longest = longest
        self._multiplexer = _UNNAMED
        self._due = math.inf
        self._result: SdoResult | None = None
        self._rest()

    def _rest(self) -> None:
        self.state = SdoClientState.IDLE
        self._due = math.inf
        self._upload = Upload(b"")
        self._download = Download(None, self._longest)

    @property
    def idle(self) -> bool:
        """Whether a transfer may begin."""
        return self.state is SdoClientState.IDLE and self._result is None

    def upload(self, index: int, subindex: int, now: float) -> list[bytes]:
        """Read an object: the request."""
        self._begin(SdoClientState.UPLOAD, index, subindex, now)
        return [protocol.upload_request(self._multiplexer)]

    def download(self, index: int, subindex: int, data: bytes, now: float) -> list[bytes]:
        """Write an object: the request."""
        self._begin(SdoClientState.DOWNLOAD, index, subindex, now)
        # Segments of either direction have one layout: what is handed out here is a download.
        self._upload = Upload(data)
        self._is_segmented = not protocol.is_expedited(data)
        return [protocol.download_request(self._multiplexer, data)]

    def receive(self, data: bytes, now: float) -> list[bytes]:
        """The requests that follow from a frame of the server; frames that are not 8 bytes long are ignored."""
        if len(data) != _FRAME or self.state is SdoClientState.IDLE:
            return []
        answer = ANSWERS[data[0]]
        named = answer in (SdoAnswer.UPLOAD, SdoAnswer.DOWNLOAD, SdoAnswer.ABORT)
        if (
            named
            and data[1:4] != self._multiplexer
            and not (answer is SdoAnswer.ABORT and data[1:4] == _UNNAMED)
        ):
            return []
        self._due = now + self._timeout
        try:
            if answer is SdoAnswer.ABORT:
                self._finish(code=protocol.abort_code(data))
                return []
            act = self.TRANSITIONS.get((self.state, answer))
            return act(self, data) if act is not None else self.give_up(AbortCode.UNKNOWN_COMMAND)
        except Abort as abort:
            return self.give_up(abort.code)

    def tick(self, now: float) -> list[bytes]:
        """End a transfer whose server is silent; the abort that says so."""
        return self.give_up(AbortCode.TIMED_OUT, silent=True) if now >= self._due else []

    def next_deadline(self) -> float:
        """When `tick` has something to do; infinity without a transfer."""
        return self._due

    def spare(self, time: float) -> None:
        """The process stood still for so many seconds: they do not count."""
        self._due += time

    def give_up(self, code: AbortCode, *, silent: bool = False) -> list[bytes]:
        """End the transfer, if there is one, and say so to the server."""
        if self.state is SdoClientState.IDLE:
            return []
        self._finish(code=code, silent=silent)
        return [protocol.abort(self._multiplexer, code)]

    def take(self) -> SdoResult | None:
        """The result of the transfer that has ended, once; None otherwise."""
        result, self._result = self._result, None
        return result

    # -- inside --------------------------------------------------------------------------------------------------

    def _begin(self, state: SdoClientState, index: int, subindex: int, now: float) -> None:
        assert self.idle
        self._multiplexer = _MULTIPLEXER.pack(index, subindex)
        self.state, self._due = state, now + self._timeout

    def _finish(self, data: bytes = b"", code: int | None = None, *, silent: bool = False) -> list[bytes]:
        index, subindex = _MULTIPLEXER.unpack(self._multiplexer)
        self._result = SdoResult(index, subindex, data, code, silent)
        self._rest()
        return []

    def _downloading(self, _data: bytes) -> list[bytes]:
        if not self._is_segmented:
            return self._finish()
        self.state = SdoClientState.DOWNLOAD_SEGMENT
        return [self._upload.segment()]

    def _segment_taken(self, data: bytes) -> list[bytes]:
        upload = self._upload
        if data[0] & _TOGGLE != upload.toggle:
            raise Abort(AbortCode.TOGGLE)
        if upload.done:
            return self._finish()
        upload.toggle ^= _TOGGLE
        return [upload.segment()]

    def _uploading(self, data: bytes) -> list[bytes]:
        value = protocol.uploaded(data)
        if value is not None:
            return self._finish(value)
        self._download = Download(protocol.announced_size(data), self._longest)
        self.state = SdoClientState.UPLOAD_SEGMENT
        return [protocol.upload_segment_request(0)]

    def _segment_given(self, data: bytes) -> list[bytes]:
        download, command = self._download, data[0]
        if command & _TOGGLE != download.toggle:
            raise Abort(AbortCode.TOGGLE)
        segment = data[1 : _FRAME - (command >> 1 & 7)]
        if not segment and not command & 0x01:
            raise Abort(AbortCode.LENGTH)  # else a server could go on for ever
        download.add(segment)
        if command & 0x01:
            return self._finish(download.whole())
        download.toggle ^= _TOGGLE
        return [protocol.upload_segment_request(download.toggle)]

    TRANSITIONS: ClassVar[dict[tuple[SdoClientState, SdoAnswer], Act]] = {
        (SdoClientState.DOWNLOAD, SdoAnswer.DOWNLOAD): _downloading,
        (SdoClientState.DOWNLOAD_SEGMENT, SdoAnswer.DOWNLOAD_SEGMENT): _segment_taken,
        (SdoClientState.UPLOAD, SdoAnswer.UPLOAD): _uploading,
        (SdoClientState.UPLOAD_SEGMENT, SdoAnswer.UPLOAD_SEGMENT): _segment_given,
    }
    """What the frames do that a state expects; any other ends the transfer."""
