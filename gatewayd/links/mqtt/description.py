"""The plan of an MQTT link in words."""

from __future__ import annotations

from gatewayd.links.contract import Description, Place
from gatewayd.links.mqtt.plan import RESULT, MqttPlan, Publication
from gatewayd.mqtt.messages import MQTT_5, BrokerTlsFiles
from gatewayd.report.format import address, counted, exact, seconds


def description(plan: MqttPlan) -> Description:
    """Settings, names of variables, topics of writers."""
    where = address(plan.host, plan.port)
    settings = {
        "broker": where,
        "version": "5" if plan.version == MQTT_5 else "3.1.1",
        "client": plan.client,
        "keepalive": seconds(plan.keepalive),
        "username": plan.username or "none",
        "password_file": plan.password_file or "none",
        "tls": _tls(plan.tls),
        "store": f"{seconds(plan.keep)}, {counted(plan.size, 'change')}" if plan.keep is not None else "none",
    }
    sparkplug = plan.sparkplug
    if sparkplug is None:
        settings |= {
            "topic": plan.topic,
            "every": seconds(plan.every) or "none",
            "retain": "true" if plan.retain else "false",
        }
    else:
        settings |= {
            "group": sparkplug.group,
            "node": sparkplug.node,
            "device": sparkplug.device,
            "primary_host": sparkplug.primary_host or "none",
        }
    return Description(
        settings=settings,
        places={each.variable: [_place(plan, each)] for each in plan.publications},
        writers={writer: _known_by(plan, name) for name, writer in plan.writers},
        address=where,
        fields={"broker": where, "client": plan.client, "topic": root_of(plan)},
    )


def root_of(plan: MqttPlan) -> str:
    """Where all of the cell is: `plant/press-3`, `spBv1.0/plant/+/hall-2/press-3`."""
    sparkplug = plan.sparkplug
    if sparkplug is None:
        return plan.topic
    return f"spBv1.0/{sparkplug.group}/+/{sparkplug.node}/{sparkplug.device}"


def _place(plan: MqttPlan, each: Publication) -> Place:
    name = each.name if plan.sparkplug is not None else plan.topic_of(each.name)
    pace = f"every {seconds(each.interval)} at most" + (
        f", by {exact(each.deadband)} at least" if each.deadband else ""
    )
    what = "metric" if plan.sparkplug is not None else "topic"
    return Place(f"{what} {name}, {pace}", {"name": name}, what, name, "", "")


def _tls(tls: BrokerTlsFiles | None) -> str:
    if tls is None:
        return "none"
    own = f"certificate {tls.certificate}, key {tls.key}" if tls.certificate else "no certificate of its own"
    return f"authorities {tls.ca or 'of the system'}, {own}"


def _known_by(plan: MqttPlan, name: str) -> str:
    if plan.sparkplug is not None:
        return "commands of the primary host" if name == "primary_host" else "commands of any host"
    return f"{plan.topic_of(name)} (answers at {plan.topic_of(name)}/{RESULT})"
