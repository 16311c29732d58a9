"""RTDE messages of a trace in words."""

from __future__ import annotations

from collections import defaultdict

from gatewayd.links.contract import Medium, TrafficDecoder
from gatewayd.report.format import counted
from gatewayd.rtde.describe import MessageStream, Recipes, package_text


class RtdeTraffic(TrafficDecoder):
    """Cuts the streams of both directions into messages."""

    medium = Medium.TCP_CLIENT
    port = 30004

    def __init__(self) -> None:
        self._streams: defaultdict[tuple[str, bool], MessageStream] = defaultdict(MessageStream)
        self._recipes: defaultdict[str, Recipes] = defaultdict(Recipes)

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """All messages that it completes."""
        packages = self._streams[peer, outgoing].feed(data)
        recipes = self._recipes[peer]
        texts = [package_text(package, recipes, from_controller=not outgoing) for package in packages]
        return "; ".join(texts) or f"the beginning of a message, {counted(len(data), 'byte')}"


DECODER = RtdeTraffic
"""Makes what puts the traffic of this kind of link into words."""
