"""CAN frames of a trace as SocketCAN and its files have them."""

from __future__ import annotations

import struct

from gatewayd.canopen.frame import Frame

_FRAME = struct.Struct(">IB3x8s")
_REMOTE = 0x4000_0000
_ID = 0x7FF


def packed(frame: Frame) -> bytes:
    """The frame as `Medium.CAN` has it."""
    if frame.remote:
        return _FRAME.pack(frame.can_id | _REMOTE, frame.length, b"")
    return _FRAME.pack(frame.can_id, len(frame.data), frame.data)


def unpacked(data: bytes) -> Frame:
    """The frame that `packed` has made. Raises struct.error for other bytes."""
    can_id, length, content = _FRAME.unpack(data)
    if can_id & _REMOTE:
        return Frame(can_id & _ID, remote=True, length=length)
    return Frame(can_id & _ID, content[:length])
