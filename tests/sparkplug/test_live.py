"""An edge node on mosquitto, and what Eclipse Tahu's host application makes of it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from gatewayd.sparkplug.declarations import QualityCode
from gatewayd.sparkplug.states import EdgeNodeState
from tests.peers.mosquitto import Mosquitto, mosquitto
from tests.peers.tahu import tahu_host
from tests.sparkplug.conformance.cases import tck
from tests.sparkplug.live import LiveNode, paho, utc

schema = pytest.importorskip("tests.sparkplug.schema")

EDGE, PRESS, LATHE = "plant/hall 2", "plant/hall 2/press-3", "plant/hall 2/lathe"


class Watcher:
    """What passes a broker in our namespace, read by Google's Protocol Buffers."""

    def __init__(self, broker: Mosquitto) -> None:
        self.messages: list[tuple[str, Any, int]] = []
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2, "watcher")
        self.client.on_message = lambda _client, _data, message: self.messages.append(
            (message.topic.split("/", 2)[2], schema.foreign(message.payload), message.qos)
        )
        self.client.connect(broker.host, broker.port)
        self.client.loop_start()
        self.client.subscribe("spBv1.0/plant/#", 1)
        broker.wait_for_line("Sending SUBACK to watcher")

    def types(self) -> list[str]:
        return [topic.partition("/")[0] for topic, _, _ in list(self.messages)]

    def bd_seqs(self, kind: str) -> list[int]:
        return [
            payload.metrics[0].long_value
            for topic, payload, _ in list(self.messages)
            if topic.startswith(kind)
        ]


@contextmanager
def watched(broker: Mosquitto) -> Iterator[Watcher]:
    watcher = Watcher(broker)
    try:
        yield watcher
    finally:
        watcher.client.disconnect()
        watcher.client.loop_stop()


def is_online(live: LiveNode) -> bool:
    return live.node.state is EdgeNodeState.ONLINE


@tck(
    "principles-persistence-clean-session-311",
    "operational-behavior-edge-node-intentional-disconnect-packet",
    "payloads-ndeath-will-message",
)
def test_a_broker_publishes_the_will_and_no_second_death_of_a_node_that_said_good_bye(tmp_path: Path) -> None:
    with mosquitto(tmp_path) as broker, watched(broker) as watcher:
        live = LiveNode(broker, next_bd_seq=255)
        live.until(lambda: watcher.types() == ["NBIRTH", "DBIRTH", "DBIRTH"], "births")
        live.drop()
        live.until(lambda: watcher.types().count("DBIRTH") == 4, "the second births")
        live.close()
        broker.wait_for_line("Received DISCONNECT from edge")
        live.until(lambda: watcher.types().count("NDEATH") == 2, "the death")
        assert watcher.bd_seqs("NBIRTH") == [255, 0]
        assert sorted(watcher.bd_seqs("NDEATH")) == [0, 255]
        assert all(qos == (1 if topic.startswith("NDEATH") else 0) for topic, _, qos in watcher.messages)
        # CONNECT with clean session, and a will with QoS 1 that is not retained (the log's c1, r0, q1).
        assert "as edge (p2, c1, k60)" in broker.text()
        broker.wait_for_line("Will message specified", "(r0, q1)")


@tck(
    "principles-persistence-clean-session-50",
    "payloads-ndeath-will-message-publisher-disconnect-mqtt50",
)
def test_with_mqtt_5_the_session_is_clean_and_disconnect_says_with_will(tmp_path: Path) -> None:
    with mosquitto(tmp_path) as broker, watched(broker) as watcher:
        live = LiveNode(broker, version=5)
        live.until(lambda: watcher.types().count("DBIRTH") == 2, "births")
        assert "as edge (p5, c1, k60)" in broker.text()
        live.close()
        live.until(lambda: watcher.types().count("NDEATH") == 2, "the death, and the will")
        assert watcher.bd_seqs("NDEATH") == [0, 0]


@pytest.mark.slow
def test_a_host_application_of_others_understands_it_all(tmp_path: Path) -> None:
    """Births, values, quality, commands, refusals, a rebirth, its own death, ours, and what was kept meanwhile."""
    with mosquitto(tmp_path) as broker, watched(broker) as watcher:
        live = LiveNode(broker, primary_host="scada", rebirth_pause=0.0)
        live.set(speed=1.5, start=False, part=-3)
        live.until(lambda: live.node.state is EdgeNodeState.WAITING, "a session")
        with tahu_host(broker, tmp_path / "host.log", "scada", "plant") as host:
            live.until(lambda: is_online(live), "births")
            live.until(lambda: len(host.of("onDeviceBirthComplete")) == 2, "two devices")
            births = host.metrics("onBirthMetric", PRESS)
            assert births["Motion/speed"][:3] == ["Double", "1.5", "live"]
            assert births["Motion/speed"][4:] == ["engUnit=mm", "Quality=192"]
            assert births["start"][:2] == ["Boolean", "false"]
            assert births["part"][:2] == ["Int16", "-3"]
            assert host.metrics("onBirthMetric", LATHE)["Motion/speed"][:2] == ["Double", "null"]
            assert host.metrics("onBirthMetric", EDGE)["bdSeq"][:2] == ["Int64", str(live.node.bd_seq)]

            at = live.set(speed=2.5, quality=QualityCode.STALE)
            live.until(lambda: len(host.of("onDataMetric", PRESS)) >= 2, "what was kept, and a value")
            kept, told = (
                host.of("onDataMetric", PRESS)[-2:],
                host.metrics("onDataMetric", PRESS)["Motion/speed"],
            )
            assert kept[-1][1] in ("Motion/speed", "start", "part")
            live.until(lambda: host.metrics("onDataMetric", PRESS)["Motion/speed"][1] == "2.5", "a value")
            told = next(one[2:] for one in host.of("onDataMetric", PRESS) if one[3] == "2.5")
            assert told == ["Double", "2.5", "live", told[3], "Quality=500"]
            assert abs(int(told[3]) - utc(at)) <= 2

            host.command("hall 2", "press-3", "start", "Boolean", "true")
            host.command("hall 2", "press-3", "part", "Int16", "-7")
            live.until(lambda: len(live.commands) == 2, "commands")
            assert [one.values for one in live.commands] == [(("start", True),), (("part", -7),)]
            live.until(
                lambda: host.of("onDataMetric", PRESS)[-1][1:4] == ["part", "Int16", "-7"], "the value"
            )

            live.decide = lambda _command: False
            host.command("hall 2", "press-3", "part", "Int16", "99")
            host.command("hall 2", "press-3", "Motion/speed", "Double", "9")
            live.until(lambda: len(live.refused) == 1, "a refusal")
            live.until(
                lambda: host.of("onDataMetric", PRESS)[-1][1:4] == ["Motion/speed", "Double", "2.5"], "it"
            )
            assert host.metrics("onDataMetric", PRESS)["part"][:2] == ["Int16", "-7"]
            assert live.refused[0].reason == "'Motion/speed': is not writable"

            assert watcher.types().count("NBIRTH") == 1, host.log()
            host.rebirth("hall 2")
            live.until(lambda: len(host.of("onDeviceBirthComplete")) == 4, "the births again")
            assert watcher.types().count("NDEATH") == 0
            assert len(set(watcher.bd_seqs("NBIRTH"))) == 1

            live.node.device_lost("lathe", time.monotonic())
            live.until(lambda: bool(host.of("onDeviceDeathComplete", LATHE)), "the death of a device")
            live.node.device_found("lathe", time.monotonic())
            live.until(lambda: len(host.of("onDeviceBirthComplete", LATHE)) == 3, "its birth")

            broker.kill()
            live.until(lambda: live.node.state is EdgeNodeState.OFFLINE, "the loss")
            times = [utc(live.set(speed=float(speed))) for speed in range(10, 15)]
            broker.start()
            live.until(lambda: len(host.of("onDeviceBirthComplete", PRESS)) == 3, "births on the new broker")
            live.until(lambda: len(live.node.history) == 0, "what was kept to be sent")
            live.until(
                lambda: sum(one[4] == "historical" for one in host.of("onDataMetric", PRESS)) >= 8, "it"
            )
            last = [one for one in host.of("onDataMetric", PRESS) if one[4] == "historical"][-5:]
            assert [float(one[3]) for one in last] == [10.0, 11.0, 12.0, 13.0, 14.0]
            assert all(abs(int(one[5]) - at) <= 2 for one, at in zip(last, times, strict=True))

            host.quit()
            live.until(lambda: live.left != [], "the host's death certificate")
            live.until(lambda: live.node.state is EdgeNodeState.WAITING, "a new session")
        assert live.host_states == [True, False, True, False]
        assert "rebirth" not in host.log().lower().replace("node control/rebirth", ""), host.log()
