"""The packets of paho on a pipe: what is used of it, and hostile bytes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.mqtt.engine import Engine
from gatewayd.mqtt.messages import MQTT_5, MQTT_311, BrokerSettings, Message
from gatewayd.mqtt.packets import MqttProtocolError, PacketSplitter

ACCEPTED = {MQTT_311: b"\x20\x02\x00\x00", MQTT_5: b"\x20\x03\x00\x00\x00"}
VERSIONS = pytest.mark.parametrize("version", [MQTT_311, MQTT_5])


class Spoken:
    """An engine and what it has said and heard."""

    def __init__(self, version: int) -> None:
        self.sent: list[bytes] = []
        self.heard: list[object] = []
        self.engine = Engine(
            BrokerSettings("b", 1, "press", version, 10, "me"), "secret", None, self.sent.append
        )
        self.engine.accepted = lambda: self.heard.append("accepted")
        self.engine.refused = self.heard.append
        self.engine.message = lambda *message: self.heard.append(message)
        self.engine.subscribed = self._subscribed
        self.engine.begin()

    def _subscribed(self, topics: Sequence[str], why: str) -> None:
        self.heard.append((tuple(topics), why))


def test_a_clean_session_that_ends_with_the_connection() -> None:
    """tck-id-principles-persistence-clean-session-311, -50."""
    old, new = Spoken(MQTT_311).sent[0], Spoken(MQTT_5).sent[0]
    assert old[2:10] == b"\x00\x04MQTT\x04\xc2", "user, password, clean session"
    assert new[2:10] == b"\x00\x04MQTT\x05\xc2", "user, password, clean start"
    assert b"\x11\x00\x00\x00\x00" in new, "session expiry interval 0"
    assert b"\x27\x00\x01\x00\x00" in new, "maximum packet size"
    assert old.endswith(b"\x00\x02me\x00\x06secret")


@VERSIONS
def test_a_message_comes_with_what_is_known_of_it(version: int) -> None:
    spoken = Spoken(version)
    spoken.engine.receive(ACCEPTED[version])
    none = b"\x00" if version == MQTT_5 else b""
    spoken.engine.receive(bytes((0x31, 5 + len(none))) + b"\x00\x01a" + none + b"hi")
    assert spoken.heard == ["accepted", ("a", b"hi", True, False)]


def test_refusals_have_words() -> None:
    spoken = Spoken(MQTT_311)
    spoken.engine.receive(b"\x20\x02\x00\x05")
    assert spoken.heard == ["Not authorized"]
    spoken = Spoken(MQTT_5)
    spoken.engine.receive(ACCEPTED[MQTT_5])
    spoken.engine.subscribe(["a", "b"], 0)
    spoken.engine.receive(b"\x90\x05" + spoken.sent[1][2:4] + b"\x00\x00\x87")
    assert spoken.heard[1:] == [(("a",), ""), (("b",), "Not authorized")]


def test_the_broker_ends_the_connection_with_a_reason() -> None:
    spoken = Spoken(MQTT_5)
    spoken.engine.receive(ACCEPTED[MQTT_5])
    with pytest.raises(ConnectionResetError, match="Session taken over"):
        spoken.engine.receive(b"\xe0\x02\x8e\x00")


def test_qos_2_is_nothing_that_anybody_subscribed_to() -> None:
    spoken = Spoken(MQTT_311)
    with pytest.raises(MqttProtocolError, match="QoS 2"):
        spoken.engine.receive(b"\x34\x06\x00\x01a\x00\x01h")


@VERSIONS
@settings(max_examples=100)
@given(data=st.data())
def test_hostile_packets_raise_nothing_else(version: int, data: st.DataObject) -> None:
    spoken = Spoken(version)
    body = data.draw(st.binary(max_size=60))
    packet = bytes((data.draw(st.integers(0, 255)), len(body))) + body
    if data.draw(st.booleans()):
        spoken.engine.receive(ACCEPTED[version])
    for whole in PacketSplitter().feed(packet):
        assert isinstance(whole, bytes)
        with suppress(MqttProtocolError, ConnectionResetError):
            spoken.engine.receive(whole)


def test_a_topic_with_wildcards_is_not_sent() -> None:
    with pytest.raises(ValueError, match="wildcards"):
        Spoken(MQTT_311).engine.publish(Message("a/#", b""))
