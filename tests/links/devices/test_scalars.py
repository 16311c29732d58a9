"""Addresses of devices, serial ports and bits, as a mapping writes them."""

from __future__ import annotations

import pytest

from gatewayd.links.devices.scalars import Bits, PortPath, Rest, Target
from tests.mapping.values import read, refused


@pytest.mark.parametrize(
    "text, shown",
    [
        ("192.0.2.30:502", "192.0.2.30:502"),
        ("192.0.2.30", "192.0.2.30:502"),
        ("island.local:1502", "island.local:1502"),
        ("'[fe80::1]:502'", "[fe80::1]:502"),
        ("'[::1]'", "[::1]:502"),
    ],
)
def test_addresses(text: str, shown: str) -> None:
    assert str(read(Target, text)) == shown


@pytest.mark.parametrize(
    "text, rule",
    [
        ("192.0.2.300:502", "bad-network-address"),
        ("'island:70000'", "out-of-range"),
        ("'island:0'", "out-of-range"),
        ("'a b'", "bad-network-address"),
        ("[1]", "wrong-type"),
        ("'http://island'", "bad-network-address"),
    ],
)
def test_what_is_no_address(text: str, rule: str) -> None:
    assert refused(Target, text)[0] == rule


def test_serial_ports() -> None:
    assert read(PortPath, "/dev/serial/by-id/usb-FTDI_FT232R-if00-port0").startswith("/dev/")
    assert refused(PortPath, "COM3")[0] == "bad-network-address"


@pytest.mark.parametrize("text, bits", [("0..7", range(8)), ("8..15", range(8, 16)), ("3..4", range(3, 5))])
def test_bits(text: str, bits: range) -> None:
    assert read(Bits, text) == bits


@pytest.mark.parametrize("text", ["7..0", "0..16", "3..3"])
def test_bits_that_a_register_does_not_have(text: str) -> None:
    assert refused(Bits, text)[0] == "out-of-range"


def test_what_is_no_range_of_bits() -> None:
    assert refused(Bits, "all")[0] == "bad-address"


@pytest.mark.parametrize("text, meant", [("keep", "keep"), ("0", "zero")])
def test_the_rest(text: str, meant: str) -> None:
    assert read(Rest, text) == meant
