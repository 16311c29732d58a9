"""The addresses of this machine: by the kernel, and by answers made by hand."""

from __future__ import annotations

import ipaddress
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.machine.addresses import own_addresses, parse


def message(address: str, *, kind: int = 20, flags: int = 0, more_flags: int | None = None) -> bytes:
    packed = ipaddress.ip_address(address).packed
    body = struct.pack("=BBBBI", 2 if len(packed) == 4 else 10, 24, flags, 0, 1)
    body += struct.pack("=HH", 4 + len(packed), 1) + packed
    if more_flags is not None:
        body += struct.pack("=HHI", 8, 8, more_flags)
    return struct.pack("=IHHII", 16 + len(body), kind, 2, 1, 0) + body


def test_of_this_machine() -> None:
    assert "127.0.0.1" in own_addresses()
    assert "192.0.2.99" not in own_addresses()


def test_several_in_one_piece() -> None:
    assert parse(message("192.0.2.1") + message("fd00::1")) == ({"192.0.2.1", "fd00::1"}, False)
    assert parse(message("192.0.2.1") + message("192.0.2.2", kind=3)) == ({"192.0.2.1"}, True)
    assert parse(b"") == (set(), True)


@pytest.mark.parametrize("flags", [{"flags": 0x40}, {"flags": 0x08}, {"more_flags": 0x40}])
def test_one_that_another_machine_may_have_does_not_count(flags: dict[str, int]) -> None:
    assert parse(message("fd00::1", **flags)) == (set(), False)


@given(st.binary(max_size=200))
def test_whatever_comes_it_ends(reply: bytes) -> None:
    found, _ended = parse(reply)
    assert all(map(ipaddress.ip_address, found))
