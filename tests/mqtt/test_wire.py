"""Numbers, texts and properties: there and back, and hostile bytes."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mqtt.wire import MqttProtocolError, PacketReader, ShortPacketError, binary, packet, text, varint


@given(st.integers(0, 268_435_455))
def test_lengths_come_back(value: int) -> None:
    reader = PacketReader(varint(value))
    assert (reader.varint(), reader.left) == (value, 0)


@pytest.mark.parametrize("value, size", [(127, 1), (128, 2), (16_383, 2), (16_384, 3), (2_097_152, 4)])
def test_lengths_are_as_short_as_the_specification_has_them(value: int, size: int) -> None:
    """3.1.1, table 2.4."""
    assert len(varint(value)) == size


@given(st.text(st.characters(blacklist_characters="\0", blacklist_categories=["Cs"])))
def test_texts_come_back(value: str) -> None:
    reader = PacketReader.of(packet(0x30, text(value) + b"rest"))
    assert (reader.text(), reader.rest()) == (value, b"rest")


def test_what_mqtt_has_no_room_for() -> None:
    with pytest.raises(ValueError, match=r"U\+0000"):
        text("a\0")
    with pytest.raises(ValueError, match="more than MQTT"):
        binary(bytes(65_536))


@pytest.mark.parametrize(
    "data, found",
    [
        (b"\x00", {}),
        (b"\x0a\x11\x00\x00\x00\x05\x27\x00\x01\x00\x00", {17: 5, 39: 65_536}),
        (b"\x0b\x26\x00\x01k\x00\x01v\x1f\x00\x01r", {}),
        (b"\x03\x0b\x80\x01", {}),
    ],
    ids=["none", "numbers", "texts", "a subscription"],
)
def test_properties(data: bytes, found: dict[int, int]) -> None:
    assert PacketReader(data).properties() == found


@pytest.mark.parametrize(
    "data, why",
    [
        (b"\x05\x11", "too early"),
        (b"\x02\x11\x00", "too early"),
        (b"\x02\x04\x00", "property 4, which does not exist"),
        (b"\x04\x24\x00\x24\x00", "property 36 stands there twice"),
        (b"\xff\xff\xff\xff\x01", "more than four bytes"),
    ],
)
def test_properties_that_are_none(data: bytes, why: str) -> None:
    with pytest.raises(MqttProtocolError, match=why):
        PacketReader(data).properties()


def test_texts_that_are_none() -> None:
    for data, why in (
        (b"\x00\x01\xff", "UTF-8"),
        (b"\x00\x01\x00", "0000"),
        (b"\x00\x03\xed\xa0\x80", "UTF-8"),
    ):
        with pytest.raises(MqttProtocolError, match=why):
            PacketReader(data).text()
    with pytest.raises(ShortPacketError):
        PacketReader(b"\x00\x02a").text()


@given(st.binary(max_size=40))
def test_hostile_bytes_raise_nothing_else(data: bytes) -> None:
    for take in ("properties", "text", "varint", "binary"):
        with suppress(MqttProtocolError):
            getattr(PacketReader(data), take)()
