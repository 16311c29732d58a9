"""What a client sends, byte for byte against paho on a socket."""

from __future__ import annotations

import select
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.mqtt import outgoing
from gatewayd.mqtt.messages import MAX_PACKET, MQTT_5, MQTT_311, BrokerSettings, Message
from gatewayd.mqtt.packets import PacketSplitter

paho = pytest.importorskip("paho.mqtt.client")

VERSIONS = pytest.mark.parametrize("version", [MQTT_311, MQTT_5])
TEXTS = st.text(
    st.characters(min_codepoint=0x20, blacklist_categories=["Cs"], blacklist_characters="+#"), max_size=30
)
TOPICS = TEXTS.filter(bool)
MESSAGES = st.builds(Message, TOPICS, st.binary(max_size=300), st.integers(0, 1), st.booleans())


class Paho:
    """paho's client, and what it sends."""

    def __init__(self, version: int, listener: socket.socket) -> None:
        clean = {} if version == MQTT_5 else {"clean_session": True}
        self.client = paho.Client(
            paho.CallbackAPIVersion.VERSION2, "press", protocol=paho.MQTTProtocolVersion(version), **clean
        )
        self._version = version
        self._listener = listener
        self.peer: socket.socket | None = None

    def connect(self) -> bytes:
        keywords = {}
        if self._version == MQTT_5:
            properties = paho.Properties(paho.PacketTypes.CONNECT)
            properties.SessionExpiryInterval, properties.MaximumPacketSize = 0, MAX_PACKET
            keywords = {"clean_start": True, "properties": properties}
        self.client.connect(*self._listener.getsockname(), keepalive=10, **keywords)
        self.peer, _address = self._listener.accept()
        return self.sent()

    def accept(self) -> None:
        """As a broker does."""
        assert self.peer is not None
        self.peer.sendall(b"\x20\x03\x00\x00\x00" if self._version == MQTT_5 else b"\x20\x02\x00\x00")
        self.hear()

    def hear(self) -> None:
        """Read what was said to it."""
        select.select([self.client.socket()], [], [], 5)
        self.client.loop_read()

    def sent(self) -> bytes:
        """The next packet."""
        assert self.peer is not None
        while self.client.want_write():
            self.client.loop_write()
        self.peer.settimeout(5)
        splitter = PacketSplitter(1 << 20)
        data = b""
        while True:
            more = self.peer.recv(65_536)
            data += more
            if splitter.feed(more):
                return data


@contextmanager
def paho_client(version: int) -> Iterator[Paho]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        found = Paho(version, listener)
        try:
            yield found
        finally:
            if found.peer is not None:
                found.peer.close()
            found.client.disconnect()


@VERSIONS
@settings(max_examples=50, deadline=None)
@given(TEXTS.filter(bool), st.none() | TEXTS, st.none() | MESSAGES)
def test_connect(version: int, user: str, password: str | None, will: Message | None) -> None:
    with paho_client(version) as peer:
        peer.client.username_pw_set(user, password)
        if will is not None:
            peer.client.will_set(will.topic, will.payload, will.qos, will.retain)
        ours = outgoing.connect(BrokerSettings("broker", 1, "press", version, 10, user), password, will)
        assert ours == peer.connect()


@VERSIONS
def test_the_others(version: int) -> None:
    with paho_client(version) as peer:
        assert outgoing.connect(BrokerSettings("b", 1, "press", version, 10), None, None) == peer.connect()
        peer.accept()
        for message in (
            Message("a", b""),
            Message("a/ü", bytes(200), 0, retain=True),
            Message("b", bytes(20_000), 1),
            Message("c", b"x", 1, retain=True),
        ):
            info = peer.client.publish(message.topic, message.payload, message.qos, message.retain)
            assert outgoing.publish(version, message, info.mid) == peer.sent()
        assert _subscribe(peer, version, lambda number: outgoing.subscribe(version, ["a", "b/#"], 1, number))
        _code, number = peer.client.unsubscribe(["a", "b/#"])
        assert outgoing.unsubscribe(version, ["a", "b/#"], number) == peer.sent()
        assert peer.peer is not None
        none = b"\0" if version == MQTT_5 else b""
        peer.peer.sendall(b"\x32" + bytes((5 + len(none),)) + b"\x00\x01a\x00\x07" + none)
        peer.hear()
        assert outgoing.puback(7) == peer.sent()
        peer.client.disconnect()
        assert peer.sent() == outgoing.DISCONNECT


def _subscribe(peer: Paho, version: int, ours: Callable[[int], bytes]) -> bool:
    if version == MQTT_5:
        options = paho.SubscribeOptions(qos=1, retainAsPublished=True)
        _code, number = peer.client.subscribe([("a", options), ("b/#", options)])
    else:
        _code, number = peer.client.subscribe([("a", 1), ("b/#", 1)])
    return ours(number) == peer.sent()


@pytest.mark.parametrize("topic", ["", "a/+", "#", "a\0"])
def test_topics_that_are_none(topic: str) -> None:
    with pytest.raises(ValueError, match=r"topic|0000"):
        outgoing.publish(MQTT_311, Message(topic, b""), 0)
