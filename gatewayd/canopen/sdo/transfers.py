"""Data on its way: what has come of a download, and what has gone of an upload. No state of the protocol is here."""

from __future__ import annotations

from binascii import crc_hqx

from gatewayd.canopen.dictionary import Abort, AbortCode
from gatewayd.canopen.sdo import protocol
from gatewayd.canopen.sdo.protocol import SEGMENT

MAX_BLOCK_SEGMENTS = 127
"""Segments of a sub-block."""

_LAST = 0x80
"""No segment follows (c)."""


class Download:
    """Collects the data of a download, never more than `longest` bytes."""

    def __init__(self, size: int | None, longest: int) -> None:
        """`size`: what the client has announced, if it has. Raises Abort if that is too much."""
        if size is not None and size > longest:
            raise Abort(AbortCode.OUT_OF_MEMORY)
        self.toggle = 0
        """Toggle bit that the next segment must have."""
        self._data = bytearray()
        self._size = size
        self._limit = longest

    def add(self, data: bytes) -> None:
        """Raises Abort for more than was announced, or than there is room for."""
        length = len(self._data) + len(data)
        if self._size is not None and length > self._size:
            raise Abort(AbortCode.TOO_LONG)
        if length > self._limit:
            raise Abort(AbortCode.OUT_OF_MEMORY)
        self._data += data

    def whole(self) -> bytes:
        """All the data. Raises Abort for less than was announced."""
        if self._size is not None and len(self._data) < self._size:
            raise Abort(AbortCode.TOO_SHORT)
        return bytes(self._data)


class Upload:
    """Hands out data segment by segment."""

    def __init__(self, data: bytes) -> None:
        self.toggle = 0
        """Toggle bit that the next request must have."""
        self._data = data
        self._position = 0

    @property
    def done(self) -> bool:
        """Whether the last segment was handed out."""
        return self._position >= max(1, len(self._data))

    def segment(self) -> bytes:
        """The next frame."""
        data = self._data[self._position : self._position + SEGMENT]
        self._position += SEGMENT
        return protocol.upload_segment(self.toggle, data, last=self.done)


class BlockDownload:
    """Puts the sub-blocks of a block download together. What comes out of sequence is left to be sent again."""

    def __init__(self, download: Download, *, checked: bool) -> None:
        """`checked`: the client makes a CRC."""
        self.pending = False
        """Segments came since the last acknowledgement."""
        self._download = download
        self._checked = checked
        self._taken = 0
        self._last: bytes | None = None

    @property
    def complete(self) -> bool:
        """Whether the last segment was taken."""
        return self._last is not None

    def receive(self, frame: bytes) -> bool:
        """Whether the sub-block is over, so that it must be acknowledged.

        It is not while its first segment is missing: what comes before that may be the rest of a sub-block that was
        acknowledged already. Silence ends it then. Raises Abort.
        """
        number = frame[0] & ~_LAST
        if number == 0:
            raise Abort(AbortCode.SEQUENCE_NUMBER)
        self.pending = True
        last = bool(frame[0] & _LAST)
        if number == self._taken + 1 and not self.complete:
            self._taken = number
            # How much of the last segment is data is known only at the end.
            if last:
                self._last = frame[1:]
            else:
                self._download.add(frame[1:])
        return self._taken > 0 and (last or number == MAX_BLOCK_SEGMENTS)

    def acknowledge(self) -> bytes:
        """The frame that says how far the sub-block was taken; the next one begins."""
        taken, self._taken = self._taken, 0
        self.pending = False
        return protocol.block_download_acknowledged(taken, MAX_BLOCK_SEGMENTS)

    def whole(self, unused: int, crc: int) -> bytes:
        """All the data; `unused` bytes of the last segment are none. Raises Abort for a wrong size or CRC."""
        assert self._last is not None
        self._download.add(self._last[: SEGMENT - unused])
        data = self._download.whole()
        if self._checked and crc_hqx(data, 0) != crc:
            raise Abort(AbortCode.CRC)
        return data


class BlockUpload:
    """Hands out data sub-block by sub-block."""

    def __init__(self, data: bytes, segments: int, *, checked: bool) -> None:
        """`segments`: how many the first sub-block may have; `checked`: the client wants a CRC. Raises Abort."""
        self._data = data
        self._checked = checked
        self._acknowledged = 0
        self.sent = 0
        """Segments of the present sub-block."""
        self._segments = _sub_block(segments)

    @property
    def done(self) -> bool:
        """Whether every segment was acknowledged."""
        return self._acknowledged >= self._total

    @property
    def _total(self) -> int:
        return max(1, -(-len(self._data) // SEGMENT))

    def sub_block(self) -> list[bytes]:
        """The frames from the first segment on that was not acknowledged."""
        first = self._acknowledged
        self.sent = min(self._segments, self._total - first)
        frames = []
        for number in range(1, self.sent + 1):
            start = (first + number - 1) * SEGMENT
            last = _LAST if first + number == self._total else 0
            data = self._data[start : start + SEGMENT]
            frames.append(bytes((last | number,)) + data.ljust(SEGMENT, b"\0"))
        return frames

    def acknowledge(self, taken: int, segments: int) -> None:
        """The client took so many segments of the sub-block; the next may have `segments`. Raises Abort."""
        if taken > self.sent:
            raise Abort(AbortCode.SEQUENCE_NUMBER)
        self._acknowledged += taken
        if not self.done:
            self._segments = _sub_block(segments)

    def end(self) -> bytes:
        """The frame that ends the upload."""
        crc = crc_hqx(self._data, 0) if self._checked else 0
        return protocol.block_upload_ended(self._total * SEGMENT - len(self._data), crc)


def _sub_block(segments: int) -> int:
    if not 1 <= segments <= MAX_BLOCK_SEGMENTS:
        raise Abort(AbortCode.BLOCK_SIZE)
    return segments
