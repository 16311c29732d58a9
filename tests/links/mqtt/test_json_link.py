"""The link of a cell, as JSON, with a broker that is the test. With real ones: tests/e2e/test_mqtt.py."""

from __future__ import annotations

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.events import EventKind
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed
from gatewayd.core.unserved import Unserved
from gatewayd.links.contract import Level
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.mqtt.messages import Message
from gatewayd.mqtt.packets import Oversized
from tests.links.mqtt.cells import BROKER, COUNT, FLAG, SPEED, VARIABLES, Rig, planned

PLC, CLOUD = 0, 1


def test_everything_is_said_when_the_broker_is_there() -> None:
    rig = Rig()
    rig.connect()
    assert rig.client.sent[0] == Message("plant/press/available", b"online", 0, retain=True)
    assert rig.link.will() == Message("plant/press/available", b"offline", 0, retain=True)
    assert rig.client.topics == ["plant/press/set"]
    assert {message.topic.rpartition("/")[2] for message in rig.client.sent[1:]} == {
        "speed",
        "flag",
        "count",
        "force",
    }
    assert rig.said("speed") | {"time": ""} == {"value": 0.0, "quality": "good", "time": "", "unit": "m/s"}


def test_then_changes_by_interval_and_deadband_and_all_of_it_every_so_often() -> None:
    rig = Rig()
    rig.connect()
    assert rig.after(0.05, count=1) == [], "less than its interval after the last time"
    assert rig.after(0.05) == ["count"]
    assert rig.after(0.2) == []
    assert rig.after(0.2, force=0.4) == [], "within the deadband"
    assert rig.after(0.2, force=0.5) == ["force"]
    assert set(rig.after(11.0)) == {"speed", "flag", "count", "force"}


def test_a_stale_value_never_looks_fresh() -> None:
    rig = Rig()
    rig.connect()
    before = rig.said("count")["time"]
    rig.client.sent.clear()
    rig.now += 6
    rig.cell.tick(rig.now)
    rig.link.tick(rig.now)
    found = rig.said("count")
    assert (found["quality"], found["value"], found["time"]) == ("stale", 0, before)


def test_changes_without_a_broker_are_kept_and_said_afterwards_behind_what_is_now() -> None:
    rig = Rig()
    rig.connect()
    rig.lose()
    for count in (1, 2, 3):
        assert rig.after(0.2, count=count) == []
    assert rig.link.health().figures["stored"] == 3
    assert rig.cell.health.words == {"mqtt_state": 1, "mqtt_stored": 3}
    rig.client.sent.clear()
    rig.connect()
    topics = [message.topic.removeprefix("plant/press/") for message in rig.client.sent]
    assert topics[0] == "available"
    assert topics[-3:] == ["history/count"] * 3
    assert topics.index("count") < topics.index("history/count")
    assert rig.cell.health.words == {"mqtt_state": 3, "mqtt_stored": 0}


def test_a_slow_broker_gets_the_newest_value_and_the_others_as_history() -> None:
    rig = Rig()
    rig.connect()
    rig.client.writable = False
    assert rig.after(0.2, count=1) == []
    assert rig.after(0.2, count=2) == []
    assert rig.link.health().words == "slow"
    rig.client.writable = True
    assert rig.after(0.2, count=3) == ["count", "history/count", "history/count"]
    assert rig.said("count")["value"] == 3


def test_nothing_is_kept_where_the_mapping_says_so() -> None:
    rig = Rig(BROKER.replace("topic", "store: {keep: none}, topic"))
    rig.connect()
    rig.lose()
    rig.after(0.2, count=1)
    assert (rig.link.health().figures["stored"], rig.link.health().figures["dropped"]) == (0, 1)


def test_a_command_is_carried_out_and_answered_with_the_truth() -> None:
    rig = Rig()
    rig.connect()
    found = rig.command({"id": "a7", "write": {"speed": 0.5, "flag": True}})
    assert (found["id"], found["result"]) == ("a7", "done")
    assert {name: each["value"] for name, each in found["values"].items()} == {"speed": 0.5, "flag": True}
    assert rig.cell.ownership.owners == [CLOUD, CLOUD]
    assert rig.command({"release": ["speed"]})["result"] == "done"
    assert rig.command({"release": "all"})["result"] == "done"
    assert rig.command({"request": "flag"})["result"] == "done"
    assert rig.link.health().figures["commands"] == 4


def test_a_refusal_says_why_and_what_the_value_is() -> None:
    rig = Rig()
    rig.connect()
    rig.cell.write(Requester(PLC, connection=1), [Change(SPEED, 0.25)], rig.now)
    found = rig.command({"write": {"flag": True, "speed": 0.75}})
    assert (found["result"], found["reason"], found["variable"], found["holder"]) == (
        "refused",
        "held",
        "speed",
        "plc",
    )
    assert {name: each["value"] for name, each in found["values"].items()} == {"speed": 0.25, "flag": False}
    assert rig.cell.image.values[FLAG] is False, "all or nothing"


@pytest.mark.parametrize(
    "payload, reason",
    [
        ({"write": {"speed": 7}}, "out_of_limits"),
        ({"write": {"speed": "fast"}}, "out_of_limits"),
        ({"write": {"flag": 2}}, "out_of_limits"),
        ({"write": {"count": 1}}, "not_writable"),
        ({"write": {"nothing": 1}}, "no_such_address"),
        ({"release": ["nothing"]}, "no_such_address"),
        ({"write": {}}, "malformed"),
        ({"say": 1}, "malformed"),
        ([], "malformed"),
        (b"", "malformed"),
        (b"[" * 60000, "malformed"),
        (b'{"write":{"speed":NaN}}', "malformed"),
        (b'{"write":{"speed":0.1,"speed":0.2}}', "malformed"),
        (b"\xff\xfe", "malformed"),
    ],
)
def test_every_refusal_is_answered_and_counted(payload: object, reason: str) -> None:
    rig = Rig()
    rig.connect()
    found = rig.command(payload)
    assert (found["result"], found["reason"]) == ("refused", reason)
    assert rig.link.health().figures["refused"] == {reason: 1}
    assert len(rig.events(EventKind.REFUSED) + rig.events(EventKind.UNSERVED)) == 1
    assert rig.cell.ownership.owners == [None, None]


@pytest.mark.parametrize("how", ["retained", "again"])
def test_what_was_kept_by_the_broker_is_not_carried_out(how: str) -> None:
    rig = Rig()
    rig.connect()
    found = rig.command({"write": {"flag": True}}, retained=how == "retained", again=how == "again")
    assert (found["result"], found["reason"]) == ("refused", "retained")
    assert rig.cell.image.values[FLAG] is False
    assert rig.cell.health.unserved[Unserved.NOT_ALLOWED] == 1
    assert rig.cell.writers.alive[CLOUD] is False, "no sign of life either"


def test_a_command_that_waited_while_the_gateway_stood_still_is_too_old() -> None:
    rig = Rig()
    rig.connect()
    assert rig.command({"write": {"flag": True}}, waited=5.0)["reason"] == "waited"
    assert rig.command({"write": {"flag": True}}, waited=0.1)["result"] == "done"


def test_a_message_that_is_too_large_is_answered() -> None:
    rig = Rig()
    rig.connect()
    rig.client.sent.clear()
    rig.link.oversized(Oversized("plant/press/set", 200_000), rig.now)
    assert rig.said("set/result")["reason"] == "malformed"
    rig.link.oversized(Oversized("plant/other", 200_000), rig.now)


def test_a_flood_is_refused_unread() -> None:
    rig = Rig()
    rig.connect()
    for _ in range(1000):
        rig.command({})
    assert rig.link.health().figures["refused"] == {"not_allowed": 900}


def test_writers_are_lost_with_the_broker_and_by_their_silence() -> None:
    rig = Rig()
    rig.connect()
    rig.command({"write": {"flag": True}})
    rig.lose()
    assert rig.owner_of_flag() is None
    assert not rig.cell.image.values[FLAG], "on_release"
    rig.connect()
    rig.command({"write": {"flag": True}})
    for _ in range(3):
        rig.after(0.9)
        rig.command({})
    assert rig.owner_of_flag() == CLOUD, "a sign of life is enough"
    rig.after(2.5)
    assert rig.owner_of_flag() is None


def test_an_answer_that_the_broker_does_not_take_is_counted() -> None:
    rig = Rig()
    rig.connect()
    rig.client.writable = False
    rig.command({"write": {"flag": True}})
    assert rig.link.health().figures["dropped"] == 1
    assert rig.cell.image.values[FLAG] is True


def test_health_says_what_is_wrong() -> None:
    rig = Rig()
    rig.connect()
    rig.session.refused["plant/press/set"] = "Not authorized"
    health = rig.link.health()
    assert health.level is Level.WARN
    assert health.problems == ("broker 127.0.0.1:1883 does not send plant/press/set: Not authorized",)
    rig.lose()
    rig.session.trouble, rig.session.refused = "Connection refused", {}
    assert rig.link.health().problems == ("broker 127.0.0.1:1883: Connection refused",)
    assert rig.link.health().level is Level.BAD


def test_a_reload_goes_on_with_what_was_said_and_owned() -> None:
    rig = Rig()
    rig.connect()
    rig.command({"write": {"flag": True}})
    variables = VARIABLES.replace("cloud: {mqtt: set,", "hmi: {mqtt: hmi, timeout: 2s}, cloud: {mqtt: set,")
    plan = planned(
        variables=variables.replace("  count:", "  more:  {robot: output_int_register_1}\n  count:")
    )
    new = plan.the(MqttPlan)
    assert rig.link.departing(new, plan.cell) == {}
    succession = succeed(rig.cell, plan.cell, rig.now, same_robot=True)
    rig.link.rebind(new, succession.cell, rig.now)
    rig.cell = succession.cell
    assert rig.client.topics == ["plant/press/set", "plant/press/hmi"]
    assert rig.cell.ownership.owners[1] == 2
    assert rig.command({"write": {"flag": False}})["result"] == "done"
    assert rig.after(0.2) == ["more"]


def test_a_writer_that_has_another_topic_departs() -> None:
    rig = Rig()
    rig.connect()
    rig.command({"write": {"flag": True}})
    plan = planned(variables=VARIABLES.replace("mqtt: set", "mqtt: other"))
    (why,) = rig.link.departing(plan.the(MqttPlan), plan.cell).values()
    assert why == "the new mapping has another writer there"
    rig.link.release(plan.the(MqttPlan), plan.cell, rig.now)
    assert rig.cell.ownership.owners[1] is None
    assert rig.link.departing(None, plan.cell) == {}, "it departed already"


def test_what_only_the_quality_says_is_a_change() -> None:
    rig = Rig()
    rig.connect()
    rig.now += 1
    rig.cell.set_availability([COUNT], False, "claimed elsewhere", rig.now)
    rig.client.sent.clear()
    rig.link.tick(rig.now)
    assert rig.said("count")["quality"] == "unavailable"


def test_that_a_value_is_good_no_longer_is_said_at_once_whatever_its_interval() -> None:
    rig = Rig(BROKER.replace("interval: 100ms", "interval: 60s").replace("every: 10s", "every: none"))
    rig.connect()
    rig.client.sent.clear()
    rig.now += 6
    rig.cell.tick(rig.now)
    rig.link.tick(rig.now)
    assert rig.said("count")["quality"] == "stale"
    assert rig.after(1) == [], "it is good again, which has time"
    assert set(rig.after(60)) >= {"count"}


def test_what_a_slow_broker_did_not_take_is_said_when_it_takes_something() -> None:
    """It was kept, as a change; but its topic still said what it had been before."""
    rig = Rig(BROKER.replace("every: 10s", "every: none"))
    rig.connect()
    rig.client.writable = False
    assert rig.after(0.2, count=1) == []
    rig.client.writable = True
    assert rig.after(0.2) == ["count", "history/count"]
    assert rig.said("count")["value"] == 1
    assert rig.after(0.2) == []


def test_a_broker_that_is_slow_from_the_first_moment_gets_all_of_it_later() -> None:
    rig = Rig(BROKER.replace("every: 10s", "every: none"))
    rig.client.writable = False
    rig.link.connected(rig.now)
    assert rig.after(0.2) == []
    rig.client.writable = True
    assert set(rig.after(0.2)) >= {"speed", "flag", "count", "force"}
    assert rig.link.health().figures["dropped"] == 0


def test_an_id_that_no_answer_can_repeat_is_refused_and_nothing_is_written() -> None:
    rig = Rig()
    rig.connect()
    found = rig.command(b'{"id": "\\ud800", "write": {"speed": 0.5}}')
    assert (found["result"], found["reason"]) == ("refused", "malformed")
    assert rig.cell.image.values[SPEED] == 0.0
    assert rig.command(b'{"write": {"\\ud800": 0.5}}')["reason"] == "no_such_address"
    assert rig.command({"id": "\U0001f600", "write": {"speed": 0.5}})["id"] == "\U0001f600"


@pytest.mark.parametrize(
    "payload",
    [
        b'{"write":{"speed":1e999}}',
        b'{"write":{"speed":-1e999}}',
        b'{"write":{"speed":NaN}}',
        b'{"write":{"speed":0,"speed":1}}',
        b'{"write":{"speed":%s}}' % (b"9" * 4000),
        b'{"write":{"speed":%s}}' % (b"9" * 5000),
        b"[" * 60_000,
        b'{"write":' * 5000,
        '{"write":{"speed":1}}'.encode("utf-16"),
        b"\0",
        b'{"write":{"speed":"\\u0000"}}',
        b'{"write":{"speed":{}}}',
        b'{"write":{"speed":null}}',
        b'{"\\ud800":1}',
        b'{"request":["\\ud800"]}',
        b'{"id":[],"write":{"speed":1}}',
        b"\xff",
    ],
)
def test_hostile_payloads_are_refused_with_words(payload: bytes) -> None:
    rig = Rig()
    rig.connect()
    assert rig.command(payload)["result"] == "refused"
    assert rig.cell.image.values[SPEED] == 0.0


def test_infinity_reaches_no_robot() -> None:
    rig = Rig(variables=VARIABLES.replace(", limits: [0, 1]", ""))
    rig.connect()
    for text in (b"1e999", b"-1e999"):
        assert rig.command(b'{"write":{"speed":%s}}' % text)["reason"] == "malformed"
