"""What the daemon needs of this kind of link."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context, LinkRuntime
from gatewayd.links.mqtt.brokers import Brokers
from gatewayd.links.mqtt.json_link import JsonLink
from gatewayd.links.mqtt.link import MqttLink
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.mapping.plan import LinkPlan


class MqttRuntime(LinkRuntime):
    """Links, and the connections that they use."""

    def share(self) -> Brokers:
        """All connections of a daemon."""
        return Brokers()

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> MqttLink:
        """A link; `Brokers.serve` has a connection for it."""
        assert isinstance(plan, MqttPlan)
        if plan.sparkplug is None:
            return JsonLink(plan, cell)
        # Most cells with a broker need none of it.
        from gatewayd.links.mqtt.sparkplug_link import SparkplugLink  # noqa: PLC0415

        assert isinstance(context.shared, Brokers)
        context.shared.state = context.state
        return SparkplugLink(plan, cell)


RUNTIME = MqttRuntime()
"""What the daemon needs of this kind of link."""
