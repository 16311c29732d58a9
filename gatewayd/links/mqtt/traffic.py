"""MQTT packets in a trace."""

from __future__ import annotations

from gatewayd.links.contract import Medium, TrafficDecoder
from gatewayd.mqtt.messages import DEFAULT_PORT
from gatewayd.mqtt.packets import Oversized, PacketSplitter
from gatewayd.mqtt.wire import MqttProtocolError
from gatewayd.mqtt.words import PacketWords
from gatewayd.report.format import counted
from gatewayd.report.printable import printable


class MqttTraffic(TrafficDecoder):
    """A passage is what was read or written at once: whole packets, or parts of them."""

    medium = Medium.TCP_CLIENT
    port = DEFAULT_PORT

    def __init__(self) -> None:
        self._splitters: dict[tuple[str, bool], PacketSplitter] = {}
        self._words: dict[str, PacketWords] = {}

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """The packets that are complete now."""
        words = self._words.setdefault(peer, PacketWords())
        splitter = self._splitters.setdefault((peer, outgoing), PacketSplitter())
        try:
            packets = splitter.feed(data)
        except MqttProtocolError as error:
            del self._splitters[peer, outgoing]
            return printable(f"not MQTT: {error}")
        said = (
            f"PUBLISH {packet.topic}: {packet.length} bytes, not read"
            if isinstance(packet, Oversized)
            else words.of(packet)
            for packet in packets
        )
        return printable("; ".join(said)) or f"{counted(len(data), 'byte')} of a packet"


DECODER = MqttTraffic
"""Makes what puts the traffic of this kind of link into words."""
