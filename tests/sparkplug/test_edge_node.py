"""The edge node where the specification says nothing: slow connections, store and forward, reloads, floods."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import pytest

from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import DeviceDeclaration, MetricDeclaration, MetricValue, QualityCode
from gatewayd.sparkplug.edge_node import EdgeNode, EdgeNodeSettings
from gatewayd.sparkplug.history import HistoryLimits
from gatewayd.sparkplug.states import TRANSITIONS, EdgeNodeSignal, EdgeNodeState
from gatewayd.sparkplug.wire import PayloadError
from tests.sparkplug.conformance.bench import (
    LATHE,
    PART,
    PRESS,
    SPEED,
    VERSION,
    Bench,
    Sent,
    aliases,
    metric,
    quality_of,
    utc,
    value_of,
)

SPEED_ALIAS, START_ALIAS, PART_ALIAS = 2, 3, 4


def online(**settings: Any) -> Bench:
    """Born, and everything taken."""
    bench = Bench(**settings).connect()
    assert bench.node.state is EdgeNodeState.ONLINE
    bench.take()
    return bench


def historical(sent: list[Sent]) -> list[tuple[str, int, object]]:
    """Device, timestamp and value of every historical metric."""
    return [
        (one.device, one_metric.timestamp, value_of(one_metric))
        for one in sent
        for one_metric in one.payload.metrics
        if one_metric.is_historical
    ]


# -- States ------------------------------------------------------------------------------------------------------------


def test_every_state_is_left_by_a_loss() -> None:
    for state in EdgeNodeState:
        after = TRANSITIONS.get((state, EdgeNodeSignal.LOST))
        assert after is (None if state is EdgeNodeState.OFFLINE else EdgeNodeState.OFFLINE)


def test_signals_that_mean_nothing_change_nothing() -> None:
    bench = Bench()
    bench.lose()
    bench.node.close(bench.now)
    bench.ask_rebirth()
    bench.state(online=True, timestamp=1)
    assert bench.node.state is EdgeNodeState.OFFLINE
    assert bench.messages == []
    bench.connect()
    bench.node.connected(bench.now)
    assert bench.types() == ["NBIRTH", "DBIRTH press-3", "DBIRTH lathe"]


@pytest.mark.parametrize("names", [("a/b", "n", ""), ("g", "", ""), ("g", "n", "h#")])
def test_names_that_no_topic_can_have(names: tuple[str, str, str]) -> None:
    with pytest.raises(ValueError, match=r"has a|is empty"):
        EdgeNode(EdgeNodeSettings(*names), Bench(), utc)


def test_death_does_not_use_up_a_sequence_number_and_nothing_follows_it() -> None:
    bench = online()
    bench.node.close(bench.now)
    assert bench.types() == ["NDEATH"]
    bench.set(speed=1.0)
    bench.wait(1.0)
    bench.ask("press-3", metric("start", boolean_value=True))
    assert bench.messages == []
    assert bench.commands == []


# -- A connection that takes nothing ----------------------------------------------------------------------------------


def test_births_go_out_as_the_connection_takes_them_and_no_data_before() -> None:
    bench = Bench()
    bench.room = 1
    bench.connect()
    bench.set(speed=1.0)
    assert bench.node.state is EdgeNodeState.BEARING
    assert bench.types() == ["NBIRTH"]
    bench.room = 1
    bench.wait(0.05)
    bench.set(speed=2.0)
    bench.room = 9
    bench.wait(0.05)
    taken = bench.take()
    assert [f"{one.type} {one.device}" for one in taken[:2]] == ["DBIRTH press-3", "DBIRTH lathe"]
    assert [one.seq for one in taken] == list(range(1, 1 + len(taken)))
    assert taken[2].values == {SPEED_ALIAS: 2.0}


def test_what_is_not_taken_is_sent_later_as_the_latest_value_and_as_history() -> None:
    bench = online()
    bench.room = 0
    for speed in (1.0, 2.0, 3.0):
        bench.set(speed=speed)
        bench.wait(0.5)
    assert bench.messages == []
    bench.room = 99
    bench.wait(0.5)
    first, *others = bench.take()
    assert first.values == {SPEED_ALIAS: 3.0}
    assert first.seq == 3
    assert [value for _, _, value in historical(others)] == [1.0, 2.0, 3.0]


def test_a_death_that_is_not_taken_is_sent_later() -> None:
    bench = online()
    bench.room = 0
    bench.node.device_lost("lathe", bench.now)
    bench.room = 9
    bench.wait(0.05)
    assert bench.types() == ["DDEATH lathe"]


def test_random_refusals_of_the_connection_leave_no_gap_and_no_data_before_births() -> None:
    chance = random.Random(11)
    bench = Bench()
    bench.connect()
    expected, born, values = 0, set(), 0
    for _ in range(1000):
        bench.room = chance.choice((0, 0, 1, 2, 50))
        match chance.randrange(8):
            case 0:
                bench.ask_rebirth()
            case 1:
                bench.node.device_lost("lathe", bench.now)
            case 2:
                bench.node.device_found("lathe", bench.now)
            case 3:
                bench.lose()
                bench.room = 50
                bench.connect()
            case _:
                bench.set("lathe", speed=chance.random())
                bench.set(start=chance.random() < 0.5)
        bench.wait(0.3, step=0.1)
        for one in bench.take():
            expected = 0 if one.type == "NBIRTH" else expected
            assert one.seq == expected
            expected = (expected + 1) % 256
            match one.type:
                case "NBIRTH":
                    born = {""}
                case "DBIRTH":
                    born.add(one.device)
                case "DDEATH":
                    born.remove(one.device)
                case _:
                    assert one.device in born
                    values += 1
    assert values > 200


# -- Store and forward -------------------------------------------------------------------------------------------------


def test_values_of_an_absence_are_forwarded_with_their_times_after_the_births() -> None:
    bench = online()
    bench.lose()
    times = []
    for speed in range(4):
        bench.set(speed=float(speed))
        times.append(utc(bench.now))
        bench.wait(1.0)
    bench.connect()
    assert bench.types() == ["NBIRTH", "DBIRTH press-3", "DBIRTH lathe"]
    bench.wait(0.1)
    sent = bench.take()
    assert historical(sent) == [("press-3", time, float(speed)) for speed, time in enumerate(times)]
    assert all(quality_of(one) == 192 for message in sent for one in message.payload.metrics)
    assert [one.seq for one in sent] == [3]
    assert len(bench.node.history) == 0


def test_values_are_kept_while_the_primary_host_is_away() -> None:
    bench = Bench("scada").connect()
    bench.state(online=True, timestamp=1)
    bench.take()
    bench.state(online=False, timestamp=2)
    bench.set(speed=1.0)
    bench.connect()
    bench.set(speed=2.0)
    bench.wait(5.0)
    assert bench.types() == ["NDEATH"]
    bench.state(online=True, timestamp=3)
    bench.wait(0.1)
    assert [value for _, _, value in historical(bench.take())] == [1.0, 2.0]


def test_live_values_are_never_behind_old_ones() -> None:
    bench = Bench(history=HistoryLimits(rate=100.0, batch=5))
    for speed in range(1000):
        bench.set(speed=float(speed))
        bench.now += 0.001
    bench.connect()
    bench.take()
    begun, forwarded = bench.now, 0
    for _ in range(40):
        bench.now += 0.05
        bench.set("lathe", speed=bench.now)
        live = bench.take()
        assert [one.device for one in live] == ["lathe"]
        assert not historical(live)
        bench.node.tick(bench.now)
        forwarded += len(historical(bench.take()))
    assert forwarded == pytest.approx((bench.now - begun) * 100, rel=0.1)


def test_what_is_too_much_is_dropped_oldest_first_and_counted() -> None:
    bench = Bench(history=HistoryLimits(size=10))
    for speed in range(25):
        bench.set(speed=float(speed))
    bench.connect()
    bench.wait(1.0)
    assert [value for _, _, value in historical(bench.take())] == [float(speed) for speed in range(15, 25)]
    assert bench.node.history.dropped == 15


def test_what_is_too_old_is_dropped_and_counted() -> None:
    bench = Bench(history=HistoryLimits(age=60.0))
    bench.set(speed=1.0)
    bench.wait(50.0, step=1.0)
    bench.set(speed=2.0)
    bench.wait(20.0, step=1.0)
    assert (len(bench.node.history), bench.node.history.dropped) == (1, 1)


def test_a_dead_device_has_no_data_and_keeps_no_other_waiting() -> None:
    bench = Bench()
    bench.set(speed=1.0)
    bench.set("lathe", speed=2.0)
    bench.node.device_lost("press-3", bench.now)
    bench.connect()
    bench.wait(1.0)
    assert historical(bench.take()) == [("lathe", utc(1000.0), 2.0)]
    bench.node.device_found("press-3", bench.now)
    bench.wait(1.0)
    assert bench.types() == ["DBIRTH press-3", "DDATA press-3"]


def test_metrics_of_the_node_are_kept_and_forwarded_too() -> None:
    bench = Bench()
    bench.node.values("", {"Properties/version": MetricValue("1", bench.now)}, bench.now)
    bench.connect()
    bench.wait(0.1)
    sent = bench.take()
    assert sent[0]["Properties/version"].string_value == "1"
    assert sent[-1].type == "NDATA"
    assert historical(sent) == [("", utc(1000.0), "1")]


# -- Rebirths ----------------------------------------------------------------------------------------------------------


def test_a_flood_of_rebirths_is_answered_once_in_a_pause() -> None:
    bench = online(rebirth_pause=2.0)
    bench.wait(2.0)
    for _ in range(1000):
        bench.ask_rebirth()
        bench.now += 0.01
        bench.set(speed=bench.now)
        bench.node.tick(bench.now)
    sent = bench.take()
    assert sum(one.type == "NBIRTH" for one in sent) in (5, 6)
    assert sum(one.type == "DDATA" for one in sent) > 900
    assert not any(one.type == "NDEATH" for one in sent)


def test_a_rebirth_that_had_to_wait_is_not_forgotten() -> None:
    bench = online()
    bench.ask_rebirth()
    bench.wait(1.9)
    assert bench.types() == []
    bench.wait(0.2)
    assert bench.types() == ["NBIRTH", "DBIRTH press-3", "DBIRTH lathe"]


# -- Reloads -----------------------------------------------------------------------------------------------------------


def test_devices_come_and_go() -> None:
    bench = online()
    mill = DeviceDeclaration("mill", (PART,))
    bench.node.redeclare([VERSION], [PRESS, mill], bench.now)
    assert bench.types() == ["DDEATH lathe", "DBIRTH mill"]
    assert bench.filters == {
        "spBv1.0/plant/NCMD/hall 2",
        "spBv1.0/plant/DCMD/hall 2/press-3",
        "spBv1.0/plant/DCMD/hall 2/mill",
    }
    bench.node.redeclare([VERSION], [LATHE], bench.now)
    assert bench.types() == ["DDEATH press-3", "DDEATH mill", "DBIRTH lathe"]
    assert bench.filters == {"spBv1.0/plant/NCMD/hall 2"}


def test_a_device_with_other_metrics_is_born_anew_with_its_values() -> None:
    bench = online()
    bench.set(speed=4.0)
    bench.take()
    bench.node.redeclare([VERSION], [replace(PRESS, metrics=(PART, SPEED)), LATHE], bench.now)
    (birth,) = bench.take()
    assert (birth.type, birth.device, birth.seq) == ("DBIRTH", "press-3", 4)
    assert aliases(birth) == {"Motion/speed": SPEED_ALIAS, "part": PART_ALIAS}
    assert birth["Motion/speed"].double_value == 4.0


def test_other_metrics_of_the_node_are_a_rebirth_with_the_same_bdseq() -> None:
    bench = online()
    bench.node.redeclare([], [PRESS, LATHE], bench.now)
    sent = bench.take()
    assert [one.type for one in sent] == ["NBIRTH", "DBIRTH", "DBIRTH"]
    assert bench.will is not None
    assert sent[0].bd_seq == bench.will.bd_seq


def test_the_same_once_more_is_nothing() -> None:
    bench = online()
    bench.node.redeclare([VERSION], [PRESS, LATHE], bench.now)
    bench.wait(1.0)
    assert bench.types() == []


def test_a_reload_while_offline_shows_in_the_next_births_and_in_what_is_kept() -> None:
    bench = Bench()
    bench.set(speed=1.0, start=True)
    bench.node.redeclare([VERSION], [replace(PRESS, metrics=(SPEED,))], bench.now)
    assert (len(bench.node.history), bench.node.history.dropped) == (1, 1)
    bench.connect()
    assert bench.types() == ["NBIRTH", "DBIRTH press-3"]


def test_a_death_of_a_reload_that_is_not_taken_becomes_a_rebirth() -> None:
    bench = online()
    bench.room = 0
    bench.node.redeclare([VERSION], [PRESS], bench.now)
    bench.room = 9
    bench.wait(3.0)
    assert bench.types() == ["NBIRTH", "DBIRTH press-3"]


# -- Values and commands -----------------------------------------------------------------------------------------------


def test_a_value_that_its_type_cannot_hold_is_an_error_of_the_caller_and_changes_nothing() -> None:
    bench = online()
    with pytest.raises(PayloadError, match="70000 is beyond"):
        bench.set(start=True, part=70_000)
    assert bench.messages == []
    bench.wait(0.1)
    assert bench.messages == []


def test_null_and_bad_values_say_so() -> None:
    bench = online()
    bench.set(quality=QualityCode.BAD, speed=None)
    (sent,) = bench.take()
    assert sent.values == {SPEED_ALIAS: None}
    assert quality_of(sent[SPEED_ALIAS]) == 0
    bench.set(quality=QualityCode.STALE, speed=5.0)
    (sent,) = bench.take()
    assert quality_of(sent[SPEED_ALIAS]) == 500


def test_a_refused_command_is_answered_with_the_truth() -> None:
    bench = online()
    bench.set(start=False, part=3)
    bench.take()
    bench.ask("press-3", metric("start", boolean_value=True), metric("part", string_value="x"))
    assert [refused.reason for refused in bench.refused] == [
        "'part': a string_value is no value of the type Int16"
    ]
    assert bench.commands == []
    (answer,) = bench.take()
    assert answer.values == {START_ALIAS: False, PART_ALIAS: 3}


def test_what_the_user_refuses_is_answered_by_show() -> None:
    bench = online()
    bench.set(start=False)
    bench.take()
    bench.ask("press-3", metric("start", boolean_value=True))
    assert [command.values for command in bench.commands] == [(("start", True),)]
    bench.node.show("press-3", ["start"], bench.now)
    (answer,) = bench.take()
    assert answer.values == {START_ALIAS: False}
    assert answer[START_ALIAS].timestamp == utc(1000.0)


def test_a_retained_command_is_refused() -> None:
    bench = online()
    bench.ask("press-3", metric("start", boolean_value=True), is_retained=True)
    bench.ask("", metric("Node Control/Rebirth", boolean_value=True), is_retained=True)
    bench.wait(5.0)
    assert [refused.reason.partition(":")[0] for refused in bench.refused] == ["is retained"] * 2
    assert bench.commands == []
    assert bench.messages == []


def test_commands_for_what_is_dead_or_not_born_are_refused() -> None:
    bench = Bench("scada").connect()
    bench.ask("press-3", metric("start", boolean_value=True))
    bench.state(online=True, timestamp=1)
    bench.node.device_lost("press-3", bench.now)
    bench.ask("press-3", metric("start", boolean_value=True))
    assert bench.commands == []
    assert len(bench.refused) == 2


@pytest.mark.parametrize(
    "topic, words",
    [
        ("spBv1.0/plant/DCMD/hall 2/mill", "no such device"),
        ("spBv1.0/plant/DCMD/hall 3/press-3", "another edge node"),
        ("spBv1.0/other/NCMD/hall 2", "another edge node"),
        ("spBv1.0/plant/NBIRTH/hall 2", "no command"),
        ("spBv1.0/STATE/other", "no command and no state of the primary host"),
        ("factory/light", "no command"),
        ("", "no command"),
    ],
)
def test_other_messages_are_ignored_with_words(topic: str, words: str) -> None:
    bench = online()
    bench.node.receive(topic, b"", bench.now)
    ((ignored, reason),) = bench.ignored_messages
    assert ignored == topic
    assert words in reason


def test_hostile_messages_of_all_kinds_do_no_harm() -> None:
    """What crashed another bridge (neuron #2521): payloads that are none, on topics that are ours."""
    chance = random.Random(7)
    bench = Bench("scada").connect()
    bench.state(online=True, timestamp=1)
    topics = ["spBv1.0/plant/NCMD/hall 2", "spBv1.0/plant/DCMD/hall 2/press-3", "spBv1.0/STATE/scada"]
    for _ in range(3000):
        bench.node.receive(chance.choice(topics), chance.randbytes(chance.randrange(60)), bench.now)
    assert bench.node.state is EdgeNodeState.ONLINE
    assert bench.commands == []
    assert len(bench.refused) + len(bench.ignored_messages) == 3000


def test_births_before_any_value_are_null_and_stale() -> None:
    bench = Bench(devices=[DeviceDeclaration("d", (MetricDeclaration("a", MetricType.INT32),))])
    bench.connect()
    (birth,) = (one for one in bench.take() if one.type == "DBIRTH")
    assert value_of(birth["a"]) is None
    assert quality_of(birth["a"]) == 500
    assert birth["a"].timestamp == utc(bench.now)


def test_time_of_a_value_is_that_of_its_source() -> None:
    bench = online()
    bench.node.values("press-3", {"Motion/speed": MetricValue(1.0, 990.0)}, bench.now)
    (sent,) = bench.take()
    assert sent[SPEED_ALIAS].timestamp == utc(990.0)
    assert sent.payload.timestamp == utc(1000.0)
