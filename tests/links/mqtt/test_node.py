"""An edge node with the cells of a gateway, whose broker is the test. The state machine itself: tests/sparkplug."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

from gatewayd.core.admission import Change
from gatewayd.core.events import EventKind
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from gatewayd.links.mqtt.node import SparkplugNode
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.links.mqtt.sparkplug_link import SparkplugLink
from gatewayd.mqtt.messages import Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.sparkplug.datatypes import MetricType, Scalar, decode_value, encode_value
from gatewayd.sparkplug.payload import Metric, Payload, decode_payload, encode_payload
from tests.links.mqtt.cells import FLAG, SPEED, FakeClient, FakeSession, Rig, planned

BROKER = "mqtt: {host: 127.0.0.1, interval: 100ms, sparkplug: {group: plant, node: hall-2}}\n"
HOSTED = BROKER.replace("node: hall-2", "node: hall-2, primary_host: scada")
VARIABLES = """\
writers: {plc: {modbus: 127.0.0.2, timeout: 1s}, cloud: {mqtt: any_host, timeout: 60s}}
variables:
  speed: {robot: input_double_register_0, owner: [plc, cloud], limits: [0, 1], unit: m/s, modbus: 0}
  flag:  {robot: input_bit_register_0, owner: cloud}
  count: {robot: output_int_register_0, modbus: 100}
"""
BY_HOST = VARIABLES.replace("any_host, timeout: 60s", "primary_host")
DCMD = "spBv1.0/plant/DCMD/hall-2/press"


class NodeRig(Rig):
    """A cell that is a device."""

    def __init__(self, state: Path, broker: str = BROKER, variables: str = VARIABLES) -> None:
        super().__init__(broker, variables)
        plan = planned(broker, variables)
        self.device = SparkplugLink(plan.the(MqttPlan), self.cell)
        self.speaker = SparkplugNode([self.device], state, lambda: 1_800_000_000.0)
        self.client = FakeClient()
        self.speaker.attach(cast("BrokerSession", FakeSession(self.client)))
        self.speaker.serve([self.device], self.now)

    async def begin(self) -> None:
        await self.speaker.preparing()
        self.speaker.connected(self.now)

    def look(self, seconds: float, **values: float) -> list[tuple[str, dict[str, Any]]]:
        self.client.sent.clear()
        self.now += seconds
        self.package(**values)
        self.speaker.tick(self.now)
        return self.taken()

    def taken(self) -> list[tuple[str, dict[str, Any]]]:
        """What was published: type, and values by alias or name."""
        found = []
        for message in self.client.sent:
            metrics = decode_payload(message.payload).metrics
            values = {
                metric.name or str(metric.alias): None if metric.value is None else metric.value.content
                for metric in metrics
            }
            found.append((message.topic.split("/")[2], values))
        return found

    def command_metrics(self, **values: tuple[MetricType, Scalar]) -> list[tuple[str, dict[str, Any]]]:
        self.client.sent.clear()
        metrics = tuple(
            Metric(name=name, timestamp=1, datatype=kind, value=encode_value(kind, value))
            for name, (kind, value) in values.items()
        )
        self.speaker.received(Received(DCMD, encode_payload(Payload(1, metrics))), self.now)
        return self.taken()


def real(metric: Metric) -> Scalar | None:
    assert metric.datatype is not None
    return None if metric.value is None else decode_value(MetricType(metric.datatype), metric.value)


async def test_births_have_types_units_and_quality(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    assert [name for name, _ in rig.taken()] == ["NBIRTH", "DBIRTH"]
    speed, flag, count = decode_payload(rig.client.sent[1].payload).metrics
    assert (speed.name, speed.datatype, real(speed)) == ("speed", MetricType.DOUBLE, 0.0)
    assert [key for key, _value in speed.properties or ()] == ["engUnit", "Quality"]
    assert (flag.datatype, count.datatype) == (MetricType.BOOLEAN, MetricType.INT32)
    assert rig.client.topics == ["spBv1.0/plant/NCMD/hall-2", DCMD]


async def test_changes_are_data_and_what_was_missed_is_history(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    assert rig.look(0.2) == []
    assert rig.look(0.2, count=4) == [("DDATA", {"3": 4})]
    rig.client.is_connected = rig.client.writable = False
    rig.speaker.lost("gone", rig.now)
    for count in (5, 6):
        assert rig.look(0.2, count=count) == []
    assert rig.device.health().figures["stored"] == 2
    rig.client.is_connected = rig.client.writable = True
    rig.client.sent.clear()
    await rig.begin()
    assert rig.taken()[1][1]["count"] == 6
    (name, _values) = rig.taken()[2]
    history = decode_payload(rig.client.sent[2].payload).metrics
    assert name == "DDATA"
    assert [(metric.is_historical, real_int(metric)) for metric in history] == [(True, 5), (True, 6)]


def real_int(metric: Metric) -> object:
    return None if metric.value is None else metric.value.content


async def test_commands_are_answered_with_the_truth(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    assert rig.command_metrics(speed=(MetricType.DOUBLE, 0.5), flag=(MetricType.BOOLEAN, True)) == [
        ("DDATA", {"1": 0.5, "2": True})
    ]
    assert rig.cell.image.values[SPEED] == 0.5
    rig.cell.write(Requester(0, connection=1), [Change(SPEED, 0.25)], rig.now)
    assert rig.command_metrics(speed=(MetricType.DOUBLE, 0.75)) == [("DDATA", {"1": 0.25})]
    (refusal,) = rig.events(EventKind.REFUSED)
    assert (refusal.writer, refusal.other) == (1, 0)
    assert rig.command_metrics(count=(MetricType.INT32, 1)) == [("DDATA", {"3": 0})]
    assert rig.device.health().figures["refused"] == {"held": 1, "malformed": 1}


async def test_retained_and_repeated_commands_are_refused(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    metric = Metric(name="flag", timestamp=1, datatype=11, value=encode_value(MetricType.BOOLEAN, value=True))
    payload = encode_payload(Payload(1, (metric,)))
    for message in (Received(DCMD, payload, retained=True), Received(DCMD, payload, again=True)):
        rig.speaker.received(message, rig.now)
    assert rig.cell.image.values[FLAG] is False
    assert rig.cell.health.unserved[Unserved.NOT_ALLOWED] == 2


async def test_a_command_that_waited_is_too_old(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path, variables=VARIABLES.replace("timeout: 60s", "timeout: 2s"))
    await rig.begin()
    metric = Metric(name="flag", timestamp=1, datatype=11, value=encode_value(MetricType.BOOLEAN, value=True))
    rig.speaker.received(Received(DCMD, encode_payload(Payload(1, (metric,))), waited=5.0), rig.now)
    assert rig.cell.image.values[FLAG] is False
    assert rig.device.health().figures["refused"] == {"waited": 1}


async def test_hostile_messages_and_floods(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    rig.speaker.oversized(Oversized(DCMD, 100_000), rig.now)
    for _ in range(1000):
        rig.speaker.received(Received(DCMD, b"\xff\xff\xff"), rig.now)
    figures = rig.device.health().figures
    assert figures["refused"] == {"malformed": 1001}


async def test_a_primary_host_that_goes_offline_is_lost(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path, HOSTED, BY_HOST)
    await rig.begin()
    assert rig.taken() == []
    rig.speaker.tick(rig.now)
    assert rig.device.health().words == "waiting for the primary host"
    rig.speaker.received(Received("spBv1.0/STATE/scada", b'{"online":true,"timestamp":1}'), rig.now)
    assert [name for name, _ in rig.taken()] == ["NBIRTH", "DBIRTH"]
    rig.command_metrics(flag=(MetricType.BOOLEAN, True))
    assert rig.owner_of_flag() == 1
    rig.speaker.received(Received("spBv1.0/STATE/scada", b'{"online":false,"timestamp":2}'), rig.now)
    assert rig.owner_of_flag() is None
    assert not rig.cell.image.values[FLAG]


async def test_bd_seq_is_kept_before_each_connection(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    assert rig.taken()[0][1]["bdSeq"] == 0
    again = NodeRig(tmp_path)
    await again.begin()
    assert again.taken()[0][1]["bdSeq"] == 1
    will = again.speaker.will()
    assert will is not None
    assert (will.topic, will.qos, will.retain) == ("spBv1.0/plant/NDEATH/hall-2", 1, False)


async def test_a_state_directory_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path / "none")
    await rig.begin()
    assert [name for name, _ in rig.taken()] == ["NBIRTH", "DBIRTH"]


async def test_a_device_that_comes_by_a_reload_is_born(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    await rig.begin()
    rig.client.sent.clear()
    other = Rig(BROKER.replace("node: hall-2", "node: hall-2, device: lathe"), VARIABLES)
    plan = planned(BROKER.replace("node: hall-2", "node: hall-2, device: lathe"), VARIABLES)
    lathe = SparkplugLink(plan.the(MqttPlan), other.cell)
    rig.speaker.serve([rig.device, lathe], rig.now)
    assert [name for name, _ in rig.taken()] == ["DBIRTH", "DDATA"]
    rig.speaker.serve([lathe], rig.now)
    assert [name for name, _ in rig.taken()] == ["DBIRTH", "DDATA", "DDEATH"]


def test_another_node_or_host_by_the_same_client_is_another_edge_node(tmp_path: Path) -> None:
    """The client identifier may be the mapping's own, and stay."""
    rig = NodeRig(tmp_path)
    assert rig.speaker.goes_on([rig.device])
    for old, new in (("node: hall-2", "node: hall-3"), ("node: hall-2", "node: hall-2, primary_host: scada")):
        other = NodeRig(tmp_path, BROKER.replace(old, new))
        assert not rig.speaker.goes_on([other.device])
    assert not rig.speaker.goes_on([])
    assert not rig.speaker.goes_on([Rig().link]), "a cell with JSON"


async def test_a_reload_changes_how_much_is_kept(tmp_path: Path) -> None:
    rig = NodeRig(tmp_path)
    other = NodeRig(tmp_path, BROKER.replace("interval", "store: {keep: none}, interval"))
    assert rig.speaker.node.history.limits.size == 10_000
    rig.speaker.serve([other.device], rig.now)
    assert rig.speaker.node.history.limits.size == 0
