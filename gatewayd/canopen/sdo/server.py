"""The SDO server: one transfer at a time, frames in and frames out (CiA 301, 7.2.4).

What a frame does follows from the state of the transfer and from what the frame asks for, by the tables of `SdoServer`.
A download reaches the dictionary once, when all of it is there and before it is confirmed; an upload takes the value
once, when it begins. What the dictionary cannot do at once (`Pending`) is confirmed when it is done; a client that
begins another transfer meanwhile has given up the answer.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.dictionary import Abort, AbortCode, Dictionary, Entry, Object, Pending, record
from gatewayd.canopen.sdo import protocol
from gatewayd.canopen.sdo.protocol import BLOCK_SEGMENTS, REQUESTS, Request
from gatewayd.canopen.sdo.transfers import MAX_BLOCK_SEGMENTS, BlockDownload, BlockUpload, Download, Upload

TIMEOUT = 1.0
"""Seconds without a frame after which a transfer is aborted."""
SUB_BLOCK_TIMEOUT = 0.25
"""Seconds without a segment after which an unfinished sub-block is acknowledged: its last segment was lost."""
SLOWEST_FRAME = 0.0135
"""Seconds that a frame takes at 10 kbit/s, the slowest bit rate: a whole sub-block is longer than `TIMEOUT`."""
WRITE_TIMEOUT = 5.0
"""Seconds that a download may take which is not done at once; then it counts as failed."""
LONGEST_DOWNLOAD = 4096
"""Bytes; far beyond the longest object."""

_FRAME = 8
_NOTHING = b"\0\0\0"
_MULTIPLEXER = struct.Struct("<HB")
_SIZE = struct.Struct("<4xI")
_CRC = struct.Struct("<xH5x")
_TOGGLE = 0x10
_CRC_SUPPORTED = 0x04


def server_parameter(node: int) -> Object:
    """1200h: the COB-IDs of the default server, which follow the node-ID and which nobody can change (7.5.2.33)."""
    request, response = Function.SDO_REQUEST + node, Function.SDO_RESPONSE + node
    return record(
        0x1200,
        "SDO server parameter",
        (
            Entry.constant(1, "COB-ID client to server", request, plus_node=True),
            Entry.constant(2, "COB-ID server to client", response, plus_node=True),
        ),
    )


class SdoState(Enum):
    """What the server waits for."""

    IDLE = "a transfer"
    DOWNLOAD = "a segment"
    UPLOAD = "the request of a segment"
    BLOCK_DOWNLOAD = "a segment of a sub-block"
    BLOCK_DOWNLOAD_END = "the end of a block download"
    BLOCK_UPLOAD_START = "the start of a block upload"
    BLOCK_UPLOAD = "the acknowledgement of a sub-block"
    BLOCK_UPLOAD_END = "the end of a block upload"
    WRITING = "the end of what a download has begun"


@dataclass(frozen=True, slots=True)
class SdoAbort:
    """A request that was refused. Index and sub-index are 0 where the frame named no object."""

    code: AbortCode
    request: Request
    index: int
    subindex: int


Act = Callable[["SdoServer", bytes], list[bytes]]
"""Takes a frame and gives the answers; raises Abort."""


class SdoServer:
    """One SDO channel."""

    def __init__(
        self,
        dictionary: Dictionary,
        longest: int = LONGEST_DOWNLOAD,
        aborted: Callable[[SdoAbort], None] = lambda _abort: None,
    ) -> None:
        """`longest`: bytes that a download may have. `aborted` hears of requests that are refused."""
        self._aborted = aborted
        self._dictionary = dictionary
        self._longest = longest
        self._multiplexer = _NOTHING
        self._heard = -math.inf
        self.reset()

    def reset(self) -> None:
        """Forget the transfer without a word: the node leaves the states in which SDO is served."""
        self.state = SdoState.IDLE
        self._download = Download(None, self._longest)
        self._upload = Upload(b"")
        self._block_download = BlockDownload(self._download, checked=False)
        self._block_upload = BlockUpload(b"", MAX_BLOCK_SEGMENTS, checked=False)
        self._pending = Pending()
        self._confirmation = b""

    def abandon(self) -> list[bytes]:
        """The device cannot go on with the transfer; what to tell its client. Nothing without one."""
        return self._abort(AbortCode.DEVICE_STATE) if self.state is not SdoState.IDLE else []

    def receive(self, data: bytes, now: float) -> list[bytes]:
        """The answers to a frame of the client; frames that are not 8 bytes long are ignored."""
        if len(data) != _FRAME:
            return []
        state = self.state
        request = (BLOCK_SEGMENTS if state is SdoState.BLOCK_DOWNLOAD else REQUESTS)[data[0]]
        self._heard = now
        act = self.IN_ANY_STATE.get(request) or self.TRANSITIONS.get((state, request))
        try:
            if act is None:
                raise self._unexpected(data)
            return act(self, data)
        except Abort as abort:
            if not abort.recorded:
                index, subindex = _MULTIPLEXER.unpack(self._multiplexer)
                self._aborted(SdoAbort(abort.code, request, index, subindex))
            return self._abort(abort.code)

    def tick(self, now: float) -> list[bytes]:
        """What the client's silence leads to, or the end of what it waits for."""
        if now < self.next_deadline(now):
            return []
        if self.state is SdoState.WRITING:
            return self._written()
        if self._block_download.pending:
            return self._acknowledge()
        return self._abort(AbortCode.TIMED_OUT)

    def next_deadline(self, now: float) -> float:
        """When `tick` will have something to do; infinity without a transfer."""
        if self.state is SdoState.IDLE:
            return math.inf
        if self.state is SdoState.WRITING:
            return -math.inf if self._pending.done else self._heard + WRITE_TIMEOUT
        if self._block_download.pending:
            return self._heard + SUB_BLOCK_TIMEOUT
        return self._heard + TIMEOUT + self._block_upload.sent * SLOWEST_FRAME

    # -- beginning and ending ------------------------------------------------------------------------------------

    def _begin(self, data: bytes) -> tuple[int, int]:
        """Index and sub-index of a new transfer; a former one ends without a word, as the client has given it up."""
        if self.state is not SdoState.IDLE:
            self.reset()
        self._multiplexer = data[1:4]
        index, subindex = _MULTIPLEXER.unpack(self._multiplexer)
        return index, subindex

    def _unexpected(self, data: bytes) -> Abort:
        if self.state is SdoState.IDLE:
            # Only a command that nobody knows may name an object; segments carry data in its place.
            self._multiplexer = data[1:4] if REQUESTS[data[0]] is Request.UNKNOWN else _NOTHING
        return Abort(AbortCode.UNKNOWN_COMMAND)

    def _abort(self, code: AbortCode) -> list[bytes]:
        self.reset()
        return [protocol.abort(self._multiplexer, code)]

    def _end(self, _data: bytes) -> list[bytes]:
        self.reset()
        return []

    def _write(self, data: bytes, confirmation: bytes) -> list[bytes]:
        """The download is whole: it is over, whatever the dictionary says."""
        if self.state is not SdoState.IDLE:
            self.reset()
        index, subindex = _MULTIPLEXER.unpack(self._multiplexer)
        pending = self._dictionary.write(index, subindex, data)
        if pending is None:
            return [confirmation]
        self.state, self._pending, self._confirmation = SdoState.WRITING, pending, confirmation
        return self._written() if pending.done else []

    def _written(self) -> list[bytes]:
        """What was pending is done, has failed, or takes too long."""
        code = self._pending.code if self._pending.done else AbortCode.TIMED_OUT
        if code is not None:
            return self._abort(code)
        confirmation = self._confirmation
        self.reset()
        return [confirmation]

    # -- download ------------------------------------------------------------------------------------------------

    def _initiate_download(self, data: bytes) -> list[bytes]:
        index, subindex = self._begin(data)
        command = data[0]
        indicated = command & 0x01
        if command & 0x02:
            size = 4 - (command >> 2 & 3) if indicated else self._natural_size(index, subindex)
            return self._write(data[4 : 4 + size], protocol.download_initiated(self._multiplexer))
        self._demand_writable(index, subindex)
        self._download = Download(_SIZE.unpack(data)[0] if indicated else None, self._longest)
        self.state = SdoState.DOWNLOAD
        return [protocol.download_initiated(self._multiplexer)]

    def _natural_size(self, index: int, subindex: int) -> int:
        """How many bytes an expedited download has that does not say it."""
        return min(4, self._dictionary.entry(index, subindex).type.size or 4)

    def _demand_writable(self, index: int, subindex: int) -> None:
        if not self._dictionary.entry(index, subindex).access.writable:
            raise Abort(AbortCode.READ_ONLY)

    def _take_segment(self, data: bytes) -> list[bytes]:
        download, command = self._download, data[0]
        toggle = download.toggle
        if command & _TOGGLE != toggle:
            raise Abort(AbortCode.TOGGLE)
        download.toggle ^= _TOGGLE
        download.add(data[1 : _FRAME - (command >> 1 & 7)])
        confirmation = protocol.download_segment_taken(toggle)
        return self._write(download.whole(), confirmation) if command & 0x01 else [confirmation]

    # -- upload --------------------------------------------------------------------------------------------------

    def _initiate_upload(self, data: bytes) -> list[bytes]:
        index, subindex = self._begin(data)
        return self._upload_of(self._dictionary.read(index, subindex))

    def _upload_of(self, value: bytes) -> list[bytes]:
        if not protocol.is_expedited(value):
            self._upload = Upload(value)
            self.state = SdoState.UPLOAD
        return [protocol.upload_initiated(self._multiplexer, value)]

    def _give_segment(self, data: bytes) -> list[bytes]:
        upload = self._upload
        if data[0] & _TOGGLE != upload.toggle:
            raise Abort(AbortCode.TOGGLE)
        segment = upload.segment()
        upload.toggle ^= _TOGGLE
        if upload.done:
            self.reset()
        return [segment]

    # -- block download ------------------------------------------------------------------------------------------

    def _initiate_block_download(self, data: bytes) -> list[bytes]:
        index, subindex = self._begin(data)
        self._demand_writable(index, subindex)
        size = _SIZE.unpack(data)[0] if data[0] & 0x02 else None
        checked = bool(data[0] & _CRC_SUPPORTED)
        self._block_download = BlockDownload(Download(size, self._longest), checked=checked)
        self.state = SdoState.BLOCK_DOWNLOAD
        return [protocol.block_download_initiated(self._multiplexer, MAX_BLOCK_SEGMENTS, checked=checked)]

    def _take_block_segment(self, data: bytes) -> list[bytes]:
        return self._acknowledge() if self._block_download.receive(data) else []

    def _acknowledge(self) -> list[bytes]:
        if self._block_download.complete:
            self.state = SdoState.BLOCK_DOWNLOAD_END
        return [self._block_download.acknowledge()]

    def _end_block_download(self, data: bytes) -> list[bytes]:
        whole = self._block_download.whole(data[0] >> 2 & 7, *_CRC.unpack(data))
        return self._write(whole, protocol.BLOCK_DOWNLOAD_ENDED)

    # -- block upload --------------------------------------------------------------------------------------------

    def _initiate_block_upload(self, data: bytes) -> list[bytes]:
        index, subindex = self._begin(data)
        segments, threshold = data[4], data[5]
        value = self._dictionary.read(index, subindex)
        if threshold and len(value) <= threshold:
            return self._upload_of(value)
        checked = bool(data[0] & _CRC_SUPPORTED)
        self._block_upload = BlockUpload(value, segments, checked=checked)
        self.state = SdoState.BLOCK_UPLOAD_START
        return [protocol.block_upload_initiated(self._multiplexer, len(value), checked=checked)]

    def _start_block_upload(self, _data: bytes) -> list[bytes]:
        self.state = SdoState.BLOCK_UPLOAD
        return self._block_upload.sub_block()

    def _next_sub_block(self, data: bytes) -> list[bytes]:
        block = self._block_upload
        block.acknowledge(data[1], data[2])
        if not block.done:
            return block.sub_block()
        self.state = SdoState.BLOCK_UPLOAD_END
        return [block.end()]

    IN_ANY_STATE: ClassVar[dict[Request, Act]] = {
        Request.DOWNLOAD: _initiate_download,
        Request.UPLOAD: _initiate_upload,
        Request.BLOCK_DOWNLOAD: _initiate_block_download,
        Request.BLOCK_UPLOAD: _initiate_block_upload,
        Request.ABORT: _end,
    }
    """What ends the present transfer, and may begin another. In a sub-block only an abort differs from data."""
    TRANSITIONS: ClassVar[dict[tuple[SdoState, Request], Act]] = {
        (SdoState.DOWNLOAD, Request.DOWNLOAD_SEGMENT): _take_segment,
        (SdoState.UPLOAD, Request.UPLOAD_SEGMENT): _give_segment,
        (SdoState.BLOCK_DOWNLOAD, Request.BLOCK_SEGMENT): _take_block_segment,
        (SdoState.BLOCK_DOWNLOAD_END, Request.BLOCK_DOWNLOAD_END): _end_block_download,
        (SdoState.BLOCK_UPLOAD_START, Request.BLOCK_UPLOAD_START): _start_block_upload,
        (SdoState.BLOCK_UPLOAD, Request.BLOCK_UPLOAD_ACKNOWLEDGE): _next_sub_block,
        (SdoState.BLOCK_UPLOAD_END, Request.BLOCK_UPLOAD_END): _end,
    }
    """What goes on with a transfer; anything else aborts it."""
