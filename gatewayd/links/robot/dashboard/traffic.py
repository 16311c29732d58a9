"""Lines of a dashboard server in a trace."""

from __future__ import annotations

from gatewayd.links.contract import Medium, TrafficDecoder
from gatewayd.report.printable import printable


class DashboardTraffic(TrafficDecoder):
    """A passage is a line, or nearly: what was said is shown as it is."""

    medium = Medium.TCP_CLIENT
    port = 29999

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """The lines in it."""
        return printable("; ".join(data.decode("utf-8", "replace").splitlines()))


DECODER = DashboardTraffic
"""Makes what puts the traffic of this kind of link into words."""
