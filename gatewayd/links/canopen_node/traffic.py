"""CAN frames of a trace, as SocketCAN and its files have them, and in words."""

from __future__ import annotations

import struct

from gatewayd.canopen.describe import frame_text
from gatewayd.canopen.frame import Frame
from gatewayd.links.contract import Medium, TrafficDecoder

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


class CanTraffic(TrafficDecoder):
    """Each frame stands for itself."""

    medium = Medium.CAN

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """`185h TPDO 1 of node 5 01 02`."""
        try:
            frame = unpacked(data)
        except struct.error:
            return super().words(data, peer, outgoing=outgoing)
        return f"{frame.can_id:03X}h {frame_text(frame)}"


DECODER = CanTraffic
"""Makes what puts the traffic of this kind of link into words."""
