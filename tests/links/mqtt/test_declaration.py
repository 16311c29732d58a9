"""What everybody may know of a cell at a broker, and what it looks like in `show`."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.links.mqtt.declaration import KIND
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.mqtt.tables import TABLES
from gatewayd.report.diff import as_text, compare
from tests.links.mqtt.cells import BROKER, VARIABLES, loaded, planned


def test_a_plan_in_words() -> None:
    plan = planned()
    found = KIND.describe(plan.the(MqttPlan), plan.cell)
    assert found.address == "127.0.0.1:1883"
    assert found.places[3][0].text == "topic plant/press/force, every 0.1 s at most, by 0.5 at least"
    assert found.writers == {1: "plant/press/set (answers at plant/press/set/result)"}
    assert dict(found.settings)["store"] == "600 s, 10000 changes"


def test_two_plans_differ_where_words_do() -> None:
    new = planned(
        BROKER.replace("every: 10s", "every: none, retain: true"),
        VARIABLES.replace("deadband: 0.5", "deadband: 1"),
    )
    text = as_text(compare(planned(), new))
    assert "~ mqtt: every 10 s -> none; retain false -> true" in text
    assert "by 0.5 at least -> " in text


def test_a_link_goes_on_where_broker_and_root_stay() -> None:
    plan = planned()
    old = plan.the(MqttPlan)
    assert KIND.fits(old, replace(old, publications=(), every=None), plan.cell, plan.cell)
    for change in ({"topic": "other"}, {"host": "127.0.0.9"}, {"client": "x"}, {"keepalive": 9}):
        assert not KIND.fits(old, replace(old, **change), plan.cell, plan.cell)


def test_what_show_has() -> None:
    found = loaded()
    assert found.cell is not None
    rows = TABLES.rows(found.cell)
    assert rows[3] == [{"mqtt_name": "plant/press/force", "mqtt_interval": 0.1, "mqtt_deadband": 0.5}]
    table = TABLES.screen_table(found.cell)
    assert table is not None
    assert table.rows[3] == ("plant/press/force", "force", "0.1 s", "0.5")
    assert TABLES.headline(planned()) == "MQTT 127.0.0.1:1883"
    assert TABLES.introduction(planned()) == "MQTT: broker 127.0.0.1:1883, topics below plant/press."
