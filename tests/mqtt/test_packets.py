"""Bytes to packets: in any pieces, with any bytes, within bounds."""

from __future__ import annotations

import random
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mqtt.packets import Oversized, PacketSplitter
from gatewayd.mqtt.wire import MqttProtocolError

PING = b"\xd0\x00"


def publish(topic: bytes, payload: bytes) -> bytes:
    body = len(topic).to_bytes(2, "big") + topic + payload
    length, head = len(body), bytearray(b"\x30")
    while True:
        length, byte = length >> 7, length & 0x7F
        head.append(byte | (0x80 if length else 0))
        if not length:
            return bytes(head) + body


@given(st.lists(st.binary(max_size=300), max_size=6), st.randoms(use_true_random=False))
def test_packets_come_whole_in_whatever_pieces(payloads: list[bytes], chance: random.Random) -> None:
    packets = [publish(b"a/b", payload) for payload in payloads]
    stream, found, splitter = b"".join(packets), list[bytes | Oversized](), PacketSplitter()
    while stream:
        size = chance.randint(1, len(stream))
        found += splitter.feed(stream[:size])
        stream = stream[size:]
    assert found == packets


@pytest.mark.parametrize("piece", [1, 7, 4096])
def test_an_oversized_message_passes_unread_and_the_next_one_is_read(piece: int) -> None:
    splitter = PacketSplitter(100)
    stream, found = publish(b"plant/set", b"x" * 5000) + PING, list[bytes | Oversized]()
    for start in range(0, len(stream), piece):
        found += splitter.feed(stream[start : start + piece])
        assert len(splitter._buffer) <= 100 + piece
    assert found == [Oversized("plant/set", 5011), PING]


def test_another_oversized_packet_is_no_mqtt() -> None:
    with pytest.raises(MqttProtocolError, match="no message"):
        PacketSplitter(100).feed(b"\x90\xff\xff\x7f")


def test_a_length_of_five_bytes_is_no_mqtt() -> None:
    with pytest.raises(MqttProtocolError, match="four bytes"):
        PacketSplitter().feed(b"\x30\xff\xff\xff\xff\x01")


@given(st.lists(st.binary(max_size=40), max_size=20))
def test_hostile_bytes_raise_one_error_at_most(pieces: list[bytes]) -> None:
    splitter = PacketSplitter(64)
    with suppress(MqttProtocolError):
        for piece in pieces:
            splitter.feed(piece)
            assert len(splitter._buffer) <= 64 + 40
