"""Commands and rebirths."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.sparkplug.actions import CommandReceived
from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import MetricDeclaration
from tests.sparkplug.conformance.bench import GROUP, NODE, Bench, metric, schema, utc
from tests.sparkplug.conformance.cases import tck

BIRTHS = ["NBIRTH", "DBIRTH press-3", "DBIRTH lathe"]
PART = 4


@tck(
    "operational-behavior-data-commands-ncmd-rebirth-verb",
    "operational-behavior-data-commands-ncmd-rebirth-name",
    "operational-behavior-data-commands-ncmd-rebirth-value",
    "operational-behavior-data-commands-rebirth-action-1",
    "operational-behavior-data-commands-rebirth-action-2",
    "operational-behavior-data-commands-rebirth-action-3",
    "payloads-nbirth-bdseq-repeat",
)
def test_a_rebirth_is_all_births_with_the_same_bdseq_and_without_a_death() -> None:
    """Others send NDEATH or raise bdSeq: node-red-contrib-sparkplug-plus #89, SparkplugNet #115, specification #199."""
    bench = Bench(next_bd_seq=5).connect()
    bench.set(speed=7.0)
    bench.wait(5.0)
    bench.take()
    bench.ask_rebirth()
    sent = bench.take()
    assert [f"{one.type} {one.device}".strip() for one in sent] == BIRTHS
    assert [one.seq for one in sent] == [0, 1, 2]
    assert sent[0].bd_seq == 5
    assert bench.node.next_bd_seq == 6
    assert sent[1]["Motion/speed"].double_value == 7.0
    bench.set(speed=8.0)
    assert [one.seq for one in bench.take()] == [3]


@tck("operational-behavior-data-commands-rebirth-action-1")
def test_data_waits_for_the_births_of_a_rebirth() -> None:
    bench = Bench().connect()
    bench.wait(5.0)
    bench.take()
    bench.room = 1
    bench.ask_rebirth()
    bench.set(speed=1.0)
    assert bench.types() == ["NBIRTH"]
    bench.room = 9
    bench.set(speed=2.0)
    assert bench.types() == []
    bench.wait(0.1)
    assert bench.types()[:2] == BIRTHS[1:]


@tck(
    "operational-behavior-data-commands-ncmd-rebirth-value",
    "operational-behavior-data-commands-ncmd-rebirth-verb",
    "operational-behavior-data-commands-ncmd-rebirth-name",
)
def test_nothing_else_is_a_rebirth() -> None:
    bench = Bench().connect()
    bench.wait(5.0)
    bench.take()
    bench.ask_rebirth(value=False)
    bench.ask("press-3", metric("Node Control/Rebirth", boolean_value=True))
    bench.ask("", metric("Node Control/rebirth", boolean_value=True))
    bench.wait(5.0)
    assert bench.messages == []
    assert len(bench.refused) == 3


@tck(
    "operational-behavior-data-commands-dcmd-verb",
    "operational-behavior-data-commands-dcmd-metric-name",
    "operational-behavior-data-commands-dcmd-metric-value",
    "topics-dcmd-topic",
    "payloads-name-cmd-requirement",
    "payloads-alias-data-cmd-requirement",
)
@pytest.mark.parametrize("more", [{}, {"timestamp": 5}, {"datatype": 2}, {"alias": PART, "name": ""}])
def test_a_command_to_a_device(more: dict[str, Any]) -> None:
    bench = Bench().connect()
    bench.ask("press-3", metric(more.pop("name", "part"), int_value=7, **more))
    assert bench.commands == [CommandReceived("press-3", (("part", 7),), utc(bench.now))]


@tck(
    "operational-behavior-data-commands-ncmd-verb",
    "operational-behavior-data-commands-ncmd-metric-name",
    "operational-behavior-data-commands-ncmd-metric-value",
    "topics-ncmd-topic",
)
def test_a_command_to_the_node() -> None:
    rate = MetricDeclaration("Node Control/Scan Rate", MetricType.INT64, is_writable=True)
    bench = Bench(metrics=[rate]).connect()
    payload = schema.ForeignPayload(timestamp=5)
    payload.metrics.add(name="Node Control/Scan Rate", long_value=250)
    bench.node.receive(f"spBv1.0/{GROUP}/NCMD/{NODE}", payload.SerializeToString(), bench.now)
    assert bench.commands == [CommandReceived("", (("Node Control/Scan Rate", 250),), 5)]


@tck(
    "operational-behavior-data-commands-dcmd-metric-name",
    "operational-behavior-data-commands-dcmd-metric-value",
    "operational-behavior-data-commands-ncmd-metric-name",
    "operational-behavior-data-commands-ncmd-metric-value",
)
def test_a_command_with_a_wrong_name_or_value_is_refused_and_answered() -> None:
    bench = Bench().connect()
    bench.set(part=3)
    bench.take()
    bench.ask("press-3", metric("part", string_value="7"))
    assert [one.values for one in bench.take()] == [{PART: 3}]
    bench.ask("press-3", metric("nothing", int_value=7))
    bench.ask("", metric("nothing", int_value=7))
    assert (bench.commands, bench.messages, len(bench.refused)) == ([], [], 3)
