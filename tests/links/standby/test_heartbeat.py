"""Heartbeats between two gateways, byte by byte, and whatever else may come."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.standby.heartbeat import SIZE, Heartbeat, decode, encode
from gatewayd.links.standby.roles import StandbyRole

NUMBERS = st.integers(1, 2**64 - 1)
HEARTBEATS = st.builds(
    Heartbeat,
    role=st.sampled_from(StandbyRole),
    connected=st.booleans(),
    ready=st.booleans(),
    fingerprint=st.integers(0, 2**32 - 1),
    number=NUMBERS,
    echo=st.integers(0, 2**64 - 1),
)


def test_layout() -> None:
    data = encode(Heartbeat(StandbyRole.ACTIVE, True, False, 0x01020304, 5, 6))
    assert data == b"GWSB\x01\x04\x01\x00\x01\x02\x03\x04" + struct.pack(">QQ", 5, 6)
    assert len(data) == SIZE == 28


@given(HEARTBEATS)
def test_what_was_said_is_heard(heartbeat: Heartbeat) -> None:
    assert decode(encode(heartbeat)) == heartbeat


@given(st.binary(max_size=64) | st.binary(min_size=SIZE, max_size=SIZE))
def test_other_bytes_are_none(data: bytes) -> None:
    found = decode(data)
    assert found is None or encode(found) == data


@pytest.mark.parametrize("place, byte", [(0, 0), (4, 2), (5, 0), (5, 99), (6, 4), (7, 1)])
def test_a_byte_that_does_not_fit_spoils_all(place: int, byte: int) -> None:
    data = bytearray(encode(Heartbeat(StandbyRole.ACTIVE, True, True, 1, 2, 3)))
    data[place] = byte
    assert decode(bytes(data)) is None


def test_a_sender_without_a_number_is_none() -> None:
    assert decode(encode(Heartbeat(StandbyRole.ACTIVE, True, True, 1, 0, 3))) is None
