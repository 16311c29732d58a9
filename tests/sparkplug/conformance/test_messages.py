"""What births, data and deaths have in them, and in what order they come."""

from __future__ import annotations

import random

import pytest

from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import MetricValue, QualityCode
from tests.sparkplug.conformance.bench import (
    GROUP,
    NODE,
    Bench,
    Sent,
    aliases,
    births,
    quality_of,
    utc,
    value_of,
)
from tests.sparkplug.conformance.cases import tck

SPEED, START, PART = 2, 3, 4


@pytest.fixture
def sent() -> list[Sent]:
    """A message of each kind, and more than 256 of them."""
    bench = Bench().connect()
    for turn in range(300):
        bench.now += 1.0
        bench.set(speed=float(turn), start=True)
        bench.node.values("", {"Properties/version": MetricValue(str(turn), bench.now)}, bench.now)
    bench.node.device_lost("lathe", bench.now)
    bench.node.device_found("lathe", bench.now)
    return bench.take()


@tck(
    "topic-structure",
    "topic-structure-namespace-a",
    "topic-structure-namespace-device-id-associated-message-types",
    "topic-structure-namespace-device-id-non-associated-message-types",
    "topics-nbirth-topic",
    "topics-ndata-topic",
    "topics-dbirth-topic",
    "topics-ddata-topic",
    "topics-ddeath-topic",
    "message-flow-edge-node-birth-publish-nbirth-topic",
    "message-flow-device-birth-publish-dbirth-topic",
    "message-flow-device-birth-publish-dbirth-match-edge-node-topic",
)
def test_topics(sent: list[Sent]) -> None:
    for one in sent:
        device = f"/{one.device}" if one.device else ""
        assert one.topic == f"spBv1.0/{GROUP}/{one.type}/{NODE}{device}"
        assert bool(one.device) is one.type.startswith("D")
    assert {one.type for one in sent} == {"NBIRTH", "NDATA", "DBIRTH", "DDATA", "DDEATH"}


@tck(
    "topics-nbirth-mqtt",
    "topics-ndata-mqtt",
    "topics-dbirth-mqtt",
    "topics-ddata-mqtt",
    "topics-ddeath-mqtt",
    "payloads-nbirth-qos",
    "payloads-nbirth-retain",
    "payloads-dbirth-qos",
    "payloads-dbirth-retain",
    "payloads-ndata-qos",
    "payloads-ndata-retain",
    "payloads-ddata-qos",
    "payloads-ddata-retain",
    "message-flow-edge-node-birth-publish-nbirth-qos",
    "message-flow-edge-node-birth-publish-nbirth-retained",
    "message-flow-device-birth-publish-dbirth-qos",
    "message-flow-device-birth-publish-dbirth-retained",
)
def test_qos_0_and_not_retained(sent: list[Sent]) -> None:
    assert {(one.qos, one.retain) for one in sent} == {(0, False)}


@tck(
    "topics-nbirth-seq-num",
    "topics-ndata-seq-num",
    "topics-dbirth-seq",
    "topics-ddata-seq-num",
    "topics-ddeath-seq-num",
    "payloads-sequence-num-always-included",
    "payloads-sequence-num-zero-nbirth",
    "payloads-sequence-num-incrementing",
    "payloads-nbirth-seq",
    "payloads-dbirth-seq",
    "payloads-dbirth-seq-inc",
    "payloads-ndata-seq",
    "payloads-ndata-seq-inc",
    "payloads-ddata-seq",
    "payloads-ddata-seq-inc",
    "payloads-ddeath-seq",
    "payloads-ddeath-seq-inc",
    "payloads-ddeath-seq-number",
    "message-flow-edge-node-birth-publish-nbirth-payload-seq",
    "message-flow-device-birth-publish-dbirth-payload-seq",
)
def test_sequence_numbers_go_over_all_messages_of_the_node_and_its_devices(sent: list[Sent]) -> None:
    assert sent[0].type == "NBIRTH"
    assert len(sent) > 512
    assert [one.seq for one in sent] == [number % 256 for number in range(len(sent))]


@tck(
    "topics-nbirth-timestamp",
    "topics-ndata-timestamp",
    "topics-dbirth-timestamp",
    "topics-ddata-timestamp",
    "payloads-timestamp-in-UTC",
    "payloads-metric-timestamp-in-UTC",
    "payloads-name-birth-data-requirement",
    "payloads-nbirth-timestamp",
    "payloads-dbirth-timestamp",
    "payloads-ndata-timestamp",
    "payloads-ddata-timestamp",
    "payloads-ddeath-timestamp",
)
def test_timestamps_are_there_and_those_of_metrics_are_the_sources() -> None:
    bench = Bench()
    bench.node.values("press-3", {"Motion/speed": MetricValue(1.0, 123.456)}, bench.now)
    bench.connect()
    bench.now = 1001.0
    bench.node.values("press-3", {"Motion/speed": MetricValue(2.0, 1000.75)}, bench.now)
    bench.node.values("", {"Properties/version": MetricValue("1", 1000.5)}, bench.now)
    bench.node.device_lost("lathe", bench.now)
    sent = bench.take()
    assert [one.payload.timestamp for one in sent] == [utc(1000.0)] * 3 + [utc(1001.0)] * 3
    assert all(one.HasField("timestamp") for message in sent for one in message.payload.metrics)
    assert sent[1]["Motion/speed"].timestamp == utc(123.456)
    assert sent[3][SPEED].timestamp == utc(1000.75)


@tck(
    "topics-nbirth-metric-reqs",
    "topics-nbirth-metrics",
    "topics-dbirth-metric-reqs",
    "topics-dbirth-metrics",
    "payloads-name-requirement",
    "payloads-alias-birth-requirement",
    "payloads-metric-datatype-req",
    "payloads-metric-datatype-value",
    "payloads-metric-datatype-value-type",
    "message-flow-edge-node-birth-publish-nbirth-payload",
    "message-flow-device-birth-publish-dbirth-payload",
    "operational-behavior-data-publish-nbirth",
    "operational-behavior-data-publish-nbirth-values",
    "operational-behavior-data-publish-dbirth",
    "operational-behavior-data-publish-dbirth-values",
)
def test_births_have_every_metric_with_name_alias_type_and_value() -> None:
    bench = Bench()
    bench.set(speed=2.5, start=True)
    node, press, _ = bench.connect().take()
    assert [one.name for one in node.payload.metrics] == [
        "bdSeq",
        "Node Control/Rebirth",
        "Properties/version",
    ]
    assert [one.name for one in press.payload.metrics] == ["Motion/speed", "start", "part"]
    assert [one.alias for one in press.payload.metrics] == [SPEED, START, PART]
    assert [one.datatype for one in press.payload.metrics] == [10, 11, 2]
    assert [value_of(one) for one in press.payload.metrics] == [2.5, True, None]
    assert press["part"].is_null
    assert all(one.HasField("datatype") for one in node.payload.metrics)
    assert value_of(node["Properties/version"]) is None


@tck(
    "topics-nbirth-rebirth-metric",
    "payloads-nbirth-rebirth-req",
    "operational-behavior-data-commands-rebirth-name",
    "operational-behavior-data-commands-rebirth-name-aliases",
    "operational-behavior-data-commands-rebirth-datatype",
    "operational-behavior-data-commands-rebirth-value",
)
def test_rebirth_control_is_false_and_has_no_alias() -> None:
    control = Bench().connect().take()[0]["Node Control/Rebirth"]
    assert control.datatype == MetricType.BOOLEAN
    assert control.HasField("boolean_value")
    assert control.boolean_value is False
    assert not control.HasField("alias")


@tck("payloads-alias-uniqueness")
def test_aliases_are_unique_in_the_node(sent: list[Sent]) -> None:
    given = [alias for one in list(births(sent))[:3] for alias in aliases(one).values()]
    assert len(given) == len(set(given)) == 5


@tck("payloads-alias-data-cmd-requirement", "payloads-metric-datatype-not-req")
def test_data_has_aliases_and_neither_names_nor_types(sent: list[Sent]) -> None:
    data = [one for message in sent if message.type.endswith("DATA") for one in message.payload.metrics]
    assert all(one.HasField("alias") for one in data)
    assert not any(one.HasField("name") or one.HasField("datatype") for one in data)


@tck(
    "topics-ndata-payload",
    "topics-ddata-payload",
    "principles-rbe-recommended",
    "operational-behavior-data-publish-nbirth-change",
    "operational-behavior-data-publish-dbirth-change",
)
def test_data_has_what_was_given_and_nothing_is_sent_by_itself() -> None:
    bench = Bench().connect()
    bench.take()
    bench.set(start=True, part=5)
    bench.node.values("", {"Properties/version": MetricValue("1", bench.now)}, bench.now)
    bench.wait(3600.0, step=1.0)
    first, second = bench.take()
    assert (first.type, first.device, first.values) == ("DDATA", "press-3", {START: True, PART: 5})
    assert (second.type, second.values) == ("NDATA", {1: "1"})


@tck("operational-behavior-data-publish-nbirth-order", "operational-behavior-data-publish-dbirth-order")
def test_values_of_a_message_are_in_the_order_of_their_times() -> None:
    bench = Bench().connect()
    bench.take()
    values = {
        "Motion/speed": MetricValue(1.0, 999.3),
        "start": MetricValue(True, 999.1),
        "part": MetricValue(1, 999.2),
    }
    bench.node.values("press-3", values, bench.now)
    (sent,) = bench.take()
    assert [one.alias for one in sent.payload.metrics] == [START, PART, SPEED]


@tck(
    "payloads-dbirth-order",
    "payloads-ndata-order",
    "payloads-ddata-order",
    "message-flow-device-birth-publish-nbirth-wait",
)
def test_births_come_before_any_data_however_slow_the_connection_is() -> None:
    chance = random.Random(2)
    for _ in range(10):
        bench = Bench()
        bench.room = 0
        bench.connect()
        for _ in range(20):
            bench.room = chance.choice((0, 1, 2))
            bench.set(speed=chance.random())
            bench.node.values("", {"Properties/version": MetricValue("1", bench.now)}, bench.now)
            bench.wait(0.1)
        kinds = bench.types()
        assert kinds[:3] == ["NBIRTH", "DBIRTH press-3", "DBIRTH lathe"]
        assert all(kind.partition(" ")[0].endswith("DATA") for kind in kinds[3:])


@tck("operational-behavior-device-ddeath")
def test_a_lost_device_dies_and_is_born_again() -> None:
    bench = Bench().connect()
    bench.take()
    bench.node.device_lost("lathe", bench.now)
    bench.node.device_lost("lathe", bench.now)
    bench.set("lathe", speed=1.0)
    (death,) = bench.take()
    assert (death.type, death.device, len(death.payload.metrics)) == ("DDEATH", "lathe", 0)
    bench.node.device_found("lathe", bench.now)
    assert bench.take()[0]["Motion/speed"].double_value == 1.0


# -- Properties --------------------------------------------------------------------------------------------------------


@tck(
    "payloads-propertyset-keys-array-size",
    "payloads-propertyset-values-array-size",
    "payloads-metric-propertyvalue-type-type",
    "payloads-metric-propertyvalue-type-value",
    "payloads-metric-propertyvalue-type-req",
)
def test_properties_have_as_many_keys_as_values_and_types(sent: list[Sent]) -> None:
    for one in sent:
        for metric in one.payload.metrics:
            assert len(metric.properties.keys) == len(metric.properties.values)
            assert all(value.HasField("type") for value in metric.properties.values)
            assert {value.type for value in metric.properties.values} <= {3, 12}
    speed = sent[1]["Motion/speed"]
    assert list(speed.properties.keys) == ["engUnit", "Quality"]
    assert speed.properties.values[0].string_value == "mm"


@tck("payloads-propertyset-quality-value-type", "payloads-propertyset-quality-value-value")
@pytest.mark.parametrize(
    "quality, number", [(QualityCode.BAD, 0), (QualityCode.GOOD, 192), (QualityCode.STALE, 500)]
)
def test_quality_is_an_int32_of_three_values(quality: QualityCode, number: int) -> None:
    bench = Bench().connect()
    bench.set(quality=quality, speed=1.0)
    value = bench.take()[-1][SPEED].properties.values[0]
    assert (value.type, value.WhichOneof("value"), value.int_value) == (3, "int_value", number)
    bench.ask_rebirth()
    bench.wait(3.0)
    assert quality_of(bench.take()[1]["Motion/speed"]) == number
