"""CAN frames of a trace in words."""

from __future__ import annotations

import struct

from gatewayd.canopen.describe import frame_text
from gatewayd.links.can_frames import unpacked
from gatewayd.links.contract import Medium, TrafficDecoder


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
