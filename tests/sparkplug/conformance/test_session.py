"""Sessions: wills, subscriptions, the primary host, ends."""

from __future__ import annotations

import pytest

from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import DeviceDeclaration
from gatewayd.sparkplug.edge_node import EdgeNode, EdgeNodeSettings
from gatewayd.sparkplug.states import EdgeNodeState
from tests.sparkplug.conformance.bench import GROUP, HOST, NODE, STATE, Bench, utc
from tests.sparkplug.conformance.cases import tck

BIRTHS = ["NBIRTH", "DBIRTH press-3", "DBIRTH lathe"]


@tck(
    "intro-group-id-string",
    "intro-group-id-chars",
    "intro-edge-node-id-string",
    "intro-edge-node-id-chars",
    "topic-structure-namespace-valid-group-id",
    "topic-structure-namespace-valid-edge-node-id",
)
@pytest.mark.parametrize("name", ["", "a+", "/b", "#", "a\0", "a\ud800"])
def test_ids_that_no_topic_can_have_are_refused(name: str) -> None:
    for names in ((name, "n"), ("g", name)):
        with pytest.raises(ValueError, match=r"has |is empty"):
            EdgeNode(EdgeNodeSettings(*names), Bench(), utc)


@tck(
    "intro-device-id-string",
    "intro-device-id-chars",
    "topic-structure-namespace-valid-device-id",
    "topic-structure-namespace-unique-device-id",
)
def test_devices_that_no_topic_can_have_or_that_are_there_twice_are_refused() -> None:
    for names in (["a/b"], ["a\x07"], ["+"], ["d", "d"]):
        with pytest.raises(ValueError, match=r"has |two devices"):
            Bench(devices=[DeviceDeclaration(name) for name in names])


@tck("topic-structure-namespace-duplicate-device-id-across-edge-node")
def test_devices_of_two_nodes_may_have_one_name() -> None:
    first, second = Bench().connect(), Bench().connect()
    assert first.types() == second.types() == BIRTHS


@tck(
    "topics-ndeath-topic",
    "topics-ndeath-payload",
    "topics-ndeath-seq",
    "payloads-ndeath-seq",
    "payloads-ndeath-will-message",
    "payloads-ndeath-will-message-qos",
    "payloads-ndeath-will-message-retain",
    "message-flow-edge-node-birth-publish-will-message",
    "message-flow-edge-node-birth-publish-will-message-topic",
    "message-flow-edge-node-birth-publish-will-message-payload",
    "message-flow-edge-node-birth-publish-will-message-qos",
    "message-flow-edge-node-birth-publish-will-message-will-retained",
)
def test_the_will_is_a_death_with_bdseq_alone() -> None:
    will = Bench().connect().will
    assert will is not None
    assert will.topic == f"spBv1.0/{GROUP}/NDEATH/{NODE}"
    assert (will.qos, will.retain, will.seq) == (1, False, None)
    assert [one.name for one in will.payload.metrics] == ["bdSeq"]


@tck(
    "topics-nbirth-bdseq-included",
    "topics-nbirth-bdseq-matching",
    "topics-nbirth-bdseq-increment",
    "payloads-nbirth-bdseq",
    "payloads-ndeath-bdseq",
    "message-flow-edge-node-birth-publish-will-message-payload-bdSeq",
    "message-flow-edge-node-birth-publish-nbirth-payload-bdSeq",
)
def test_bdseq_begins_at_0_goes_up_with_each_connect_and_is_that_of_the_will() -> None:
    bench = Bench()
    for session in range(300):
        bench.connect()
        birth = bench.take()[0]
        bench.lose()
        assert bench.will is not None
        assert birth.bd_seq == bench.will.bd_seq == session % 256
        assert birth["bdSeq"].datatype == bench.will["bdSeq"].datatype == MetricType.INT64


@tck("topics-nbirth-bdseq-increment")
def test_bdseq_survives_a_restart_and_a_connect_without_an_answer_uses_one_up() -> None:
    bench = Bench(next_bd_seq=17)
    bench.node.will(bench.now)
    bench.node.will(bench.now)
    assert bench.node.next_bd_seq == 17, "nothing was sent"
    bench.node.connecting()
    assert bench.node.next_bd_seq == 18
    bench.connect()
    assert bench.take()[0].bd_seq == 18
    assert Bench(next_bd_seq=bench.node.next_bd_seq).connect().take()[0].bd_seq == 19


@tck(
    "message-flow-edge-node-ncmd-subscribe",
    "message-flow-device-dcmd-subscribe",
    "topics-ncmd-topic",
    "topics-dcmd-topic",
)
def test_commands_of_the_node_and_of_devices_with_outputs_are_subscribed_to_before_births() -> None:
    bench = Bench()
    bench.room = 0
    bench.connect()
    assert bench.filters == {f"spBv1.0/{GROUP}/NCMD/{NODE}", f"spBv1.0/{GROUP}/DCMD/{NODE}/press-3"}


@tck("message-flow-edge-node-birth-publish-connect", "principles-birth-certificates-order")
def test_nothing_is_sent_without_a_session_and_births_are_the_first() -> None:
    bench = Bench()
    bench.set(speed=1.0)
    bench.node.device_lost("lathe", bench.now)
    bench.node.device_found("lathe", bench.now)
    bench.wait(5.0)
    bench.node.close(bench.now)
    assert bench.messages == []
    bench.connect()
    bench.wait(1.0)
    assert bench.types()[:3] == BIRTHS


# -- The primary host --------------------------------------------------------------------------------------------------


@tck(
    "message-flow-edge-node-birth-publish-phid-wait",
    "message-flow-edge-node-birth-publish-phid-wait-online",
    "operational-behavior-edge-node-birth-sequence-wait",
    "operational-behavior-primary-application-state-with-multiple-servers-state-subs",
)
def test_births_wait_until_the_primary_host_is_online() -> None:
    bench = Bench(HOST).connect()
    assert STATE in bench.filters
    bench.wait(60.0, step=1.0)
    bench.ask_rebirth()
    bench.state(online=False, timestamp=5)
    bench.wait(60.0, step=1.0)
    assert bench.messages == []
    assert bench.left == [], "there is one server: it waits here"
    bench.state(online=True, timestamp=6)
    assert bench.types() == BIRTHS
    assert bench.host_states == [True]


@tck("message-flow-edge-node-birth-publish-phid-wait-id")
def test_another_host_is_not_the_primary() -> None:
    bench = Bench(HOST).connect()
    bench.state(online=True, timestamp=5, host="scada2")
    assert bench.messages == []
    bench.state(online=True, timestamp=5)
    bench.take()
    bench.state(online=False, timestamp=9, host="scada2")
    assert bench.node.state is EdgeNodeState.ONLINE


@tck(
    "message-flow-edge-node-birth-publish-phid-wait-timestamp",
    "operational-behavior-edge-node-termination-host-offline-timestamp",
)
def test_a_state_that_is_older_than_the_last_does_not_count() -> None:
    """The death certificate of a session that the host has left arrives late."""
    bench = Bench(HOST).connect()
    bench.state(online=False, timestamp=50)
    bench.state(online=True, timestamp=49)
    assert bench.messages == []
    bench.state(online=True, timestamp=50)
    assert bench.types() == BIRTHS
    bench.state(online=False, timestamp=49)
    assert bench.node.state is EdgeNodeState.ONLINE
    assert bench.left == []
    assert len(bench.ignored_messages) == 2
    assert "before 50" in bench.ignored_messages[0][1]


@tck(
    "message-flow-edge-node-birth-publish-phid-offline",
    "operational-behavior-edge-node-termination-host-offline",
    "operational-behavior-edge-node-termination-host-offline-reconnect",
)
@pytest.mark.parametrize("timestamp", [5, 6])
def test_an_offline_primary_host_is_left_with_a_death_and_waited_for_anew(timestamp: int) -> None:
    bench = Bench(HOST).connect()
    bench.state(online=True, timestamp=5)
    bench.take()
    bench.state(online=False, timestamp=timestamp)
    (death,) = bench.take()
    assert (death.type, death.bd_seq) == ("NDEATH", 0)
    assert bench.left == ["the primary host scada is offline"]
    bench.lose()
    bench.connect()
    bench.state(online=False, timestamp=timestamp)
    bench.wait(5.0)
    assert bench.messages == []
    bench.state(online=True, timestamp=timestamp)
    assert bench.take()[0].bd_seq == 1
    assert bench.host_states == [True, False, True]


@tck("operational-behavior-primary-application-state-with-multiple-servers-walk")
def test_where_there_are_more_servers_a_node_walks_on() -> None:
    bench = Bench(HOST, leaves_waiting=True).connect()
    bench.state(online=False, timestamp=5)
    assert bench.left == ["the primary host scada is offline"]
    assert bench.messages == [], "births are the first messages, and there was none"
    assert bench.node.state is EdgeNodeState.OFFLINE


@tck("operational-behavior-primary-application-state-with-multiple-servers-single-server")
def test_a_second_session_is_none() -> None:
    bench = Bench().connect()
    bench.take()
    bench.node.connected(bench.now)
    assert bench.messages == []


# -- The end -----------------------------------------------------------------------------------------------------------


@tck(
    "operational-behavior-edge-node-intentional-disconnect-ndeath",
    "payloads-ndeath-will-message-publisher",
    "payloads-ndeath-will-message-publisher-disconnect-mqtt311",
    "payloads-ndeath-bdseq",
)
def test_a_node_that_goes_publishes_its_death() -> None:
    bench = Bench(next_bd_seq=9).connect()
    bench.take()
    bench.node.close(bench.now)
    (death,) = bench.take()
    assert (death.type, death.qos, death.retain, death.seq, death.bd_seq) == ("NDEATH", 1, False, None, 9)
    assert [one.name for one in death.payload.metrics] == ["bdSeq"]
