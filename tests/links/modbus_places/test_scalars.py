"""Modbus addresses as a mapping writes them."""

from __future__ import annotations

import pytest

from gatewayd.links.modbus_places.scalars import Address
from tests.mapping.values import read, refused


@pytest.mark.parametrize(
    "text, address",
    [
        ("0", (0, None)),
        ("65535", (65535, None)),
        ("0.10", (0, 10)),
        ("0.1", (0, 1)),
        ("'12.15'", (12, 15)),
        ("0x10", (16, None)),
        ("0XfFfF", (65535, None)),
        ("0x1F.3", (31, 3)),
        ("100.high", (100, "high")),
        ("0x64.low", (100, "low")),
    ],
)
def test_addresses(text: str, address: tuple[int, int | str | None]) -> None:
    """The text counts: `0.10` is bit 10, not bit 1."""
    assert read(Address, text) == address


@pytest.mark.parametrize(
    "text, slug",
    [
        ("-1", "bad-address"),
        ("0x", "bad-address"),
        ("0x1G", "bad-address"),
        ("0b11", "bad-address"),
        ("100.middle", "bad-address"),
        ("0x10000", "out-of-range"),
        ("010", "bad-address"),
        ("1e2", "bad-address"),
        ("0.01", "bad-address"),
        ("first", "bad-address"),
        ("1.2.3", "bad-address"),
        ("65536", "out-of-range"),
        ("0.16", "out-of-range"),
        ("{a: 1}", "wrong-type"),
    ],
)
def test_refused_addresses(text: str, slug: str) -> None:
    assert refused(Address, text)[0] == slug


@pytest.mark.parametrize(
    "digits, hint", [("400101", "{holding: 100}"), ("300001", "{input: 0}"), ("100008", "{discrete: 7}")]
)
def test_six_digit_notation_is_explained(digits: str, hint: str) -> None:
    """4xxxxx is never guessed, but the finding says what to write."""
    assert hint in refused(Address, digits)[2]
