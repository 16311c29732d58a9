"""MQTT in mapping files. Each rule's examples: tests/mapping/test_rules.py."""

from __future__ import annotations

import pytest

from gatewayd.links.mqtt.plan import MqttPlan, Publication, SparkplugPlan
from gatewayd.mqtt.messages import MQTT_5, MQTT_311, BrokerSettings, BrokerTlsFiles
from tests.links.mqtt.cells import BROKER, VARIABLES, loaded, planned


def of(
    broker: str, variables: str = "variables:\n  count: {robot: output_int_register_0, modbus: 100}\n"
) -> MqttPlan:
    return planned(broker, variables).the(MqttPlan)


def findings(broker: str = BROKER, variables: str = VARIABLES) -> list[tuple[str, str]]:
    return [(each.rule.slug, each.message) for each in loaded(broker, variables).diagnostics]


def test_a_short_section_has_defaults() -> None:
    plan = of("mqtt: {host: 127.0.0.1, topic: plant/press}\n")
    assert plan.broker == BrokerSettings("127.0.0.1", 1883, "gatewayd-press", MQTT_311, 10)
    assert (plan.topic, plan.every, plan.retain, plan.keep, plan.size) == (
        "plant/press",
        60.0,
        False,
        600.0,
        10_000,
    )
    assert plan.publications == (Publication(0, "count", 0.0, 1.0),)


def test_everything_that_can_be_said() -> None:
    plan = of(
        "mqtt:\n  host: broker.example\n  version: 5\n  username: press\n  password_file: /etc/secret\n"
        "  tls: {ca: ca.pem, certificate: own.pem, key: own.key}\n  client: me\n  keepalive: 30s\n"
        "  topic: a\n  publish: named\n  every: none\n  retain: true\n  store: {keep: 1min, size: 5}\n",
        "variables:\n  seen: {robot: 'output_int_register_0..1', mqtt: {name: x/y, interval: 5s, deadband: 2}}\n"
        "  unseen: {robot: output_int_register_2, modbus: 1}\n",
    )
    tls = BrokerTlsFiles("ca.pem", "own.pem", "own.key")
    assert plan.broker == BrokerSettings(
        "broker.example", 8883, "me", MQTT_5, 30, "press", "/etc/secret", tls
    )
    assert (plan.every, plan.retain, plan.keep, plan.size) == (None, True, 60.0, 5)
    assert plan.publications == (Publication(0, "x/y[0]", 2.0, 5.0), Publication(1, "x/y[1]", 2.0, 5.0))


def test_a_variable_may_be_left_out() -> None:
    plan = of(BROKER, "variables:\n  count: {robot: output_int_register_0, modbus: 100, mqtt: none}\n")
    assert plan.publications == ()


def test_an_edge_node_is_its_clients_name() -> None:
    plan = of("mqtt: {host: 127.0.0.1, sparkplug: {group: plant, node: hall-2, primary_host: scada}}\n")
    assert plan.sparkplug == SparkplugPlan("plant", "hall-2", "press", "scada")
    assert plan.client == "gatewayd-plant-hall-2"


@pytest.mark.parametrize(
    "broker, slug, text",
    [
        ("mqtt: {host: 127.0.0.1}\n", "missing-key", "found neither"),
        ("mqtt: {host: h, topic: a, sparkplug: {group: a, node: b}}\n", "missing-key", "found both"),
        ("mqtt: {host: h, topic: a, version: 4}\n", "bad-choice", "`4` is no version of MQTT"),
        ("mqtt: {host: h, topic: a, password_file: x}\n", "missing-key", "`password_file` needs `username`"),
        ("mqtt: {host: h, topic: a, tls: {key: x}}\n", "missing-key", "`key` needs `certificate`"),
        ("mqtt: {host: h, topic: $SYS/a}\n", "bad-topic", "belong to the broker"),
        (
            "mqtt: {host: h, sparkplug: {group: a/b, node: b}}\n",
            "bad-topic",
            "`a/b` is not a name for Sparkplug",
        ),
        ("mqtt: {host: h, topic: a, password: x}\n", "unknown-key", "password"),
        ("mqtt: {host: h, sparkplug: {group: a, node: b}, retain: true}\n", "key-without-effect", "`retain`"),
    ],
)
def test_what_is_wrong_is_found(broker: str, slug: str, text: str) -> None:
    variables = "variables:\n  count: {robot: output_int_register_0, modbus: 100}\n"
    found = findings(broker, variables)
    assert any(slug == known and text in message for known, message in found), found


def test_a_writer_without_a_timeout_is_noticed_by_nobody() -> None:
    variables = VARIABLES.replace("{mqtt: set, timeout: 2s}", "{mqtt: set}").replace(
        "owner: [plc, cloud]", "owner: plc"
    )
    assert ("unsupervised-writer", "nobody notices when `cloud` hangs; it keeps `flag`") in findings(
        variables=variables
    )
    broker = "mqtt: {host: 127.0.0.1, sparkplug: {group: p, node: n, primary_host: scada}}\n"
    assert not findings(broker, variables.replace("mqtt: set", "mqtt: primary_host"))


def test_its_writers_give_no_commands() -> None:
    """What starts a program is meant at the moment; a message by a broker may come late."""
    found = loaded(
        "mqtt: {host: 127.0.0.1, topic: plant/press}\n",
        "writers: {cloud: {mqtt: set, timeout: 2s}}\nvariables:\n  start: {dashboard: play, owner: cloud}\n",
    )
    assert any(each.rule.id == "GW855" for each in found.diagnostics), found.diagnostics


def test_an_owner_by_mqtt_needs_a_name_there() -> None:
    variables = VARIABLES.replace("owner: cloud}", "owner: cloud, modbus: 50.0, mqtt: none}")
    assert "owner-without-name" in dict(findings(variables=variables))


def test_grace_is_of_no_use() -> None:
    variables = VARIABLES.replace("timeout: 2s", "timeout: 2s, grace: 1s")
    assert any("`cloud` has `grace`" in message for _slug, message in findings(variables=variables))


def test_a_section_with_a_fault_leaves_no_variable_unmapped() -> None:
    variables = "variables:\n  count: {robot: output_int_register_0}\n"
    broken = findings("mqtt: {host: 127.0.0.1, topic: plant/press, interval: fast}\n", variables)
    assert [slug for slug, _ in broken] == ["bad-duration"]
    assert "unmapped-variable" in [slug for slug, _ in findings("", variables)]
