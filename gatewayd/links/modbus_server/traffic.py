"""Modbus TCP frames of a trace in words."""

from __future__ import annotations

from collections import OrderedDict

from gatewayd.links.contract import Medium, TrafficDecoder
from gatewayd.modbus.describe import answer_text, request_text
from gatewayd.modbus.frames import HEADER_SIZE

_REMEMBERED = 1024
"""Requests that wait for their answers."""


class ModbusTraffic(TrafficDecoder):
    """Tells what the values of an answer are by the request that it belongs to."""

    medium = Medium.TCP_SERVER
    port = 502

    def __init__(self) -> None:
        self._requests: OrderedDict[tuple[str, bytes], bytes] = OrderedDict()

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """`unit 1: read holding 100-103`."""
        if len(data) <= HEADER_SIZE:
            return super().words(data, peer, outgoing=outgoing)
        key, unit, pdu = (peer, data[:2]), data[HEADER_SIZE - 1], data[HEADER_SIZE:]
        if outgoing:
            return f"unit {unit}: {answer_text(pdu, self._requests.pop(key, None))}"
        self._requests[key] = pdu
        if len(self._requests) > _REMEMBERED:
            self._requests.popitem(last=False)
        return f"unit {unit}: {request_text(pdu)}"


DECODER = ModbusTraffic
"""Makes what puts the traffic of this kind of link into words."""
