"""A connection's packets: what each does, pings, limits of the broker, and hostile bytes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.mqtt.engine import MAX_PENDING, Engine
from gatewayd.mqtt.messages import MQTT_5, MQTT_311, BrokerSettings, Message
from gatewayd.mqtt.packets import PacketSplitter
from gatewayd.mqtt.wire import MqttProtocolError

PING = b"\xc0\x00"
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
    assert spoken.heard == ["not authorized"]
    spoken = Spoken(MQTT_5)
    spoken.engine.receive(ACCEPTED[MQTT_5])
    spoken.engine.subscribe(["a", "b"], 0)
    spoken.engine.receive(b"\x90\x05" + spoken.sent[1][2:4] + b"\x00\x00\x87")
    assert spoken.heard[1:] == [(("a",), ""), (("b",), "not authorized")]


def test_the_broker_ends_the_connection_with_a_reason() -> None:
    spoken = Spoken(MQTT_5)
    spoken.engine.receive(ACCEPTED[MQTT_5])
    with pytest.raises(ConnectionResetError, match="session taken over"):
        spoken.engine.receive(b"\xe0\x02\x8e\x00")


def test_qos_2_is_nothing_that_anybody_subscribed_to() -> None:
    with pytest.raises(MqttProtocolError, match="QoS 2"):
        accepted(MQTT_311).engine.receive(b"\x34\x06\x00\x01a\x00\x01h")


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


def accepted(version: int, properties: bytes = b"") -> Spoken:
    spoken = Spoken(version)
    if version == MQTT_5:
        spoken.engine.receive(bytes((0x20, 3 + len(properties), 0, 0, len(properties))) + properties)
    else:
        spoken.engine.receive(ACCEPTED[version])
    del spoken.sent[:], spoken.heard[:]
    return spoken


def test_a_topic_with_wildcards_is_not_sent() -> None:
    with pytest.raises(ValueError, match="no topic"):
        Spoken(MQTT_311).engine.publish(Message("a/#", b""))


@VERSIONS
def test_a_message_with_qos_1_is_acknowledged(version: int) -> None:
    spoken = accepted(version)
    none = b"\x00" if version == MQTT_5 else b""
    spoken.engine.receive(bytes((0x3A, 6 + len(none))) + b"\x00\x01a\x01\x02" + none + b"h")
    assert spoken.heard == [("a", b"h", False, True)]
    assert spoken.sent == [b"\x40\x02\x01\x02"]


def test_pings_are_sent_when_either_side_is_silent_and_have_to_be_answered() -> None:
    spoken = accepted(MQTT_311)
    engine = spoken.engine
    for now in (100.0, 105.0, 109.9):
        engine.tick(now)
        engine.publish(Message("a", b""))
    assert PING not in spoken.sent
    engine.tick(110.0)
    assert spoken.sent[-1] == PING, "the broker has said nothing, whatever we say"
    engine.tick(119.9)
    engine.receive(b"\xd0\x00")
    engine.tick(125.0)
    engine.tick(130.0)
    assert spoken.sent.count(PING) == 2
    engine.gap(60.0)
    engine.tick(199.9)
    with pytest.raises(TimeoutError):
        engine.tick(200.0)


@pytest.mark.parametrize("wanted, after", [(3, 3), (60, 10), (0, 10)])
def test_the_broker_may_want_more_pings_never_fewer(wanted: int, after: int) -> None:
    """MQTT 5.0, 3.2.2.3.14; without pings nobody would notice that it is gone."""
    spoken = accepted(MQTT_5, b"\x13" + wanted.to_bytes(2, "big"))
    spoken.engine.tick(0.0)
    spoken.engine.tick(after - 0.1)
    assert spoken.sent == []
    spoken.engine.tick(after)
    assert spoken.sent == [PING]


def test_no_message_is_larger_than_the_broker_takes() -> None:
    """MQTT 5.0, 3.2.2.3.6."""
    spoken = accepted(MQTT_5, b"\x27\x00\x00\x00\x10")
    spoken.engine.publish(Message("a", bytes(10)))
    with pytest.raises(ValueError, match="17 bytes, and the broker takes 16"):
        spoken.engine.publish(Message("a", bytes(11)))
    assert len(spoken.sent) == 1


@VERSIONS
@pytest.mark.parametrize(
    "packet",
    [
        b"\x20\x03\x00\x00\x00", b"\x10\x00", b"\x50\x02\x00\x01", b"\x82\x00", b"\xc0\x00", b"\xf0\x00", b"\xd1\x00",
        b"\x40\x01\x00", b"\x90\x03\x00\x63\x00", b"\x30\x02\x00\x00", b"\x30\x03\x00\x01\xff", b"\x30\x03\x00\x01\x00",
    ],
)  # fmt: skip
def test_what_no_broker_sends(version: int, packet: bytes) -> None:
    with pytest.raises(MqttProtocolError):
        accepted(version).engine.receive(packet)


def test_nothing_comes_before_the_answer_to_connect() -> None:
    with pytest.raises(MqttProtocolError, match="before"):
        Spoken(MQTT_311).engine.receive(b"\x30\x03\x00\x01a")


def test_a_broker_that_answers_nothing_is_asked_for_so_much_only() -> None:
    engine = accepted(MQTT_311).engine
    for _ in range(MAX_PENDING):
        engine.subscribe(["a"], 0)
    with pytest.raises(ValueError, match="answers no subscription"):
        engine.subscribe(["a"], 0)
