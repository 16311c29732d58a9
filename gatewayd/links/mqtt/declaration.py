"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.core.status_layout import StatusField
from gatewayd.links.contract import Description, LinkKind, LinkMetric
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.mapping.plan import LinkPlan

STATE_WORD, STORED_WORD = "mqtt_state", "mqtt_stored"


class MqttKind(LinkKind):
    """The kind of the section `mqtt`."""

    key = MqttPlan.kind
    title = "MQTT"
    traffic = "gatewayd.links.mqtt.traffic"
    doctor = "gatewayd.links.mqtt.doctor"
    place = "name that it is published by, or null"
    has_one_place = True
    fields = {  # noqa: RUF012 - never changed
        "broker": "host:port of the broker",
        "client": "client identifier",
        "topic": "what its topics begin with",
        "state": "`not connected`, `connected`, `slow` (the broker does not take what it is given), `waiting for the "
        "primary host`",
        "trouble": "why it is not connected, or which topics the broker refuses, or empty",
        "connections": "connections since the start; the first one is not a reconnect",
        "published": "messages that the broker took",
        "stored": "changes that are kept until the broker is there",
        "dropped": "what the broker never got: changes beyond the bounds of `store`, answers to commands",
        "commands": "commands that were carried out",
        "refused": "commands that were refused, by reason",
    }
    status_fields = (
        StatusField(
            54,
            1,
            STATE_WORD,
            "MQTT: 0 none declared, 1 not connected, 2 slow, 3 connected, 4 waiting for the primary host",
        ),
        StatusField(
            55,
            1,
            STORED_WORD,
            "MQTT: changes that are kept until the broker is there, 65535: as many or more",
        ),
    )
    metrics = (
        LinkMetric("gatewayd_mqtt_up", "up", "1 while the broker is connected"),
        LinkMetric("gatewayd_mqtt_connections_total", "connections", "connections to the broker"),
        LinkMetric("gatewayd_mqtt_published_total", "published", "messages that the broker took"),
        LinkMetric("gatewayd_mqtt_stored", "stored", "changes that are kept until the broker is there"),
        LinkMetric(
            "gatewayd_mqtt_dropped_total",
            "dropped",
            "changes and answers that the broker never got",
        ),
        LinkMetric("gatewayd_mqtt_commands_total", "commands", "commands by MQTT that were carried out"),
        LinkMetric(
            "gatewayd_mqtt_refused_total", "refused", "commands by MQTT that were refused", label="reason"
        ),
    )

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """The broker and the names."""
        # Words for people, which neither a check nor a start needs.
        from gatewayd.links.mqtt.description import description  # noqa: PLC0415

        assert isinstance(plan, MqttPlan)
        return description(plan)

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """The connection goes on to the same broker, as the same client with the same root of topics."""
        assert isinstance(old, MqttPlan)
        assert isinstance(new, MqttPlan)
        return (old.broker, old.topic, old.sparkplug) == (new.broker, new.topic, new.sparkplug)


KIND = MqttKind()
"""What everybody may know of this kind of link."""
