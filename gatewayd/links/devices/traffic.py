"""Frames of devices in words. Which protocol it is, the name of the line says."""

from __future__ import annotations

import struct
from collections import OrderedDict
from typing import Final

from gatewayd.canopen.describe import frame_text
from gatewayd.links.can_frames import unpacked
from gatewayd.links.contract import Medium, TrafficDecoder
from gatewayd.modbus.describe import answer_text, request_text
from gatewayd.modbus.frames import HEADER_SIZE

_REMEMBERED: Final = 1024
"""Requests that wait for their answers."""
_CHECK: Final = 2
"""Bytes behind an RTU frame."""


class DeviceTraffic(TrafficDecoder):
    """Tells what the values of an answer are by the request that it belongs to."""

    medium = Medium.OTHER

    def __init__(self) -> None:
        self._requests: OrderedDict[tuple[str, bytes], bytes] = OrderedDict()

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """`unit 1: read holding 100-103`; an answer that came in several pieces is not put together."""
        if peer.startswith("CAN "):
            return self._frame(data) or super().words(data, peer, outgoing=outgoing)
        is_rtu = peer.startswith("/") or peer.endswith(" RTU")
        if len(data) <= (_CHECK + 1 if is_rtu else HEADER_SIZE):
            return super().words(data, peer, outgoing=outgoing)
        if is_rtu:
            key, unit, pdu = (peer, data[:1]), data[0], data[1:-_CHECK]
        else:
            key, unit, pdu = (peer, data[:2]), data[HEADER_SIZE - 1], data[HEADER_SIZE:]
        if not outgoing:
            return f"unit {unit}: {answer_text(pdu, self._requests.pop(key, None))}"
        self._requests[key] = pdu
        if len(self._requests) > _REMEMBERED:
            self._requests.popitem(last=False)
        return f"unit {unit}: {request_text(pdu)}"

    @staticmethod
    def _frame(data: bytes) -> str:
        """`185h TPDO 1 of node 5 01 02`; empty for what is no CAN frame."""
        try:
            frame = unpacked(data)
        except struct.error:
            return ""
        return f"{frame.can_id:03X}h {frame_text(frame)}"


DECODER = DeviceTraffic
"""Makes what puts the traffic of this kind of link into words."""
