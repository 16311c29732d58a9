"""Packets in words, made by paho and by chance."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mqtt.engine import Engine
from gatewayd.mqtt.messages import MQTT_5, MQTT_311, BrokerSettings, Message
from gatewayd.mqtt.words import PacketWords


def spoken(version: int) -> list[bytes]:
    """CONNECT, and once accepted SUBSCRIBE, PUBLISH and DISCONNECT."""
    sent: list[bytes] = []
    will = Message("plant/available", b"offline", 0, retain=True)
    engine = Engine(BrokerSettings("broker", 1883, "press", version), None, will, sent.append)
    engine.begin()
    engine.receive(b"\x20\x03\x00\x00\x00" if version == MQTT_5 else b"\x20\x02\x00\x00")
    engine.subscribe(["plant/set"], 0)
    engine.publish(Message("plant/speed", b'{"value":0.5}', 0, retain=True))
    engine.end()
    return sent


@pytest.mark.parametrize("version, name", [(MQTT_311, "3.1.1"), (MQTT_5, "5")])
@pytest.mark.parametrize("from_the_first", [True, False])
def test_what_is_said(version: int, name: str, from_the_first: bool) -> None:
    words, packets = PacketWords(), spoken(version)
    expected = [
        f"CONNECT as press, MQTT {name}, clean session, keep alive 10 s, with a will",
        "SUBSCRIBE plant/set",
        'PUBLISH plant/speed (retained): {"value":0.5}',
        "DISCONNECT",
    ]
    start = 0 if from_the_first else 1
    assert [words.of(packet) for packet in packets[start:]] == expected[start:]


def test_answers() -> None:
    words = PacketWords()
    assert words.of(b"\x20\x02\x00\x00") == "CONNACK accepted"
    assert words.of(b"\x20\x02\x00\x05") == "CONNACK refused: not authorized"
    assert words.of(b"\x90\x03\x00\x01\x80") == "SUBACK 1 refused"
    assert words.of(b"\xd0\x00") == "PINGRESP"
    assert words.of(b"\x30\x05\x00\x01ahi") == "PUBLISH a: hi"
    assert words.of(b"\x30\x01\x00") == "PUBLISH cut short"
    assert words.of(b"\x30\x05\x00\x01a\xff\x00") == "PUBLISH a: ff 00"


@given(st.binary(min_size=1, max_size=80))
def test_any_bytes(packet: bytes) -> None:
    assert isinstance(PacketWords().of(packet), str)
