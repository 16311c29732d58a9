"""The small languages inside a mapping."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Fallback, FallbackKind
from gatewayd.links.modbus_places.scalars import Address
from gatewayd.links.robot.scalars import RobotReference, Version
from gatewayd.mapping import scalars, tables
from gatewayd.mapping.typed import Invalid
from tests.mapping.values import read, refused


@pytest.mark.parametrize(
    "text, seconds",
    [("100ms", 0.1), ("2s", 2.0), ("1.5s", 1.5), ("5min", 300.0), ("1 h", 3600.0), ("'20 ms'", 0.02)],
)
def test_durations(text: str, seconds: float) -> None:
    assert read(scalars.Duration, text) == pytest.approx(seconds)


@pytest.mark.parametrize(
    "text, slug",
    [
        ("100", "bad-duration"),
        ("1.5", "bad-duration"),
        ("2 sec", "bad-duration"),
        ("-2s", "bad-duration"),
        ("none", "bad-duration"),
        ("0s", "out-of-range"),
        ("25h", "out-of-range"),
        ("[1s]", "wrong-type"),
        ("true", "wrong-type"),
    ],
)
def test_refused_durations(text: str, slug: str) -> None:
    """A bare number has no unit; nothing is guessed."""
    assert refused(scalars.Duration, text)[0] == slug


def test_duration_without_unit_shows_the_ways_out() -> None:
    assert refused(scalars.Duration, "100")[1:] == (
        "the duration `100` has no unit",
        "write 100ms, 100s or 100min",
    )


def test_no_duration() -> None:
    assert read(scalars.OptionalDuration, "none") is None


@pytest.mark.parametrize(
    "text, host, port", [("127.0.0.1:1502", "127.0.0.1", 1502), ("'[::1]:502'", "::1", 502)]
)
def test_listen_addresses(text: str, host: str, port: int) -> None:
    endpoint = read(scalars.Listen, text)
    assert (endpoint.host, endpoint.port) == (host, port)
    assert str(endpoint) == text.strip("'")


@pytest.mark.parametrize(
    "text, slug",
    [
        ("1502", "bad-network-address"),
        ("localhost:502", "bad-network-address"),
        ("'::1:502'", "bad-network-address"),
        ("'[127.0.0.1]:502'", "bad-network-address"),
        ("1.2.3.4:0", "out-of-range"),
        ("1.2.3.4:70000", "out-of-range"),
    ],
)
def test_refused_listen_addresses(text: str, slug: str) -> None:
    """Names are not resolved: where a gateway listens must not hang on a name server."""
    assert refused(scalars.Listen, text)[0] == slug


def test_networks() -> None:
    networks = read(scalars.Networks, "[192.0.2.20, 198.51.100.0/24, 'fe80::/64']")
    assert [str(network) for network in networks] == ["192.0.2.20/32", "198.51.100.0/24", "fe80::/64"]
    assert len(read(scalars.Networks, "192.0.2.20")) == 1


@pytest.mark.parametrize(
    "text, hint",
    [("192.0.2.5/24", "192.0.2.0/24"), ("plc", "write an address"), ("[]", "name at least one")],
)
def test_refused_networks(text: str, hint: str) -> None:
    assert hint in refused(scalars.Networks, text)[2]


@pytest.mark.parametrize(
    "text, slug",
    [
        ("1e2", "bad-number"),
        ("0x10", "bad-number"),
        ("010", "bad-number"),
        ("'12'", "bad-number"),
        ("1_000", "bad-number"),
        (".inf", "bad-number"),
        (".nan", "bad-number"),
        ("9" * 400, "bad-number"),
        ("9" * 400 + ".0", "bad-number"),
        ("fast", "wrong-type"),
    ],
)
def test_refused_numbers(text: str, slug: str) -> None:
    """Only plain decimals: other shapes are read differently by other tools."""
    assert refused(scalars.Real, text)[0] == slug


@pytest.mark.parametrize(
    "text, fallback",
    [
        ("clear", Fallback()),
        ("hold", Fallback(FallbackKind.HOLD)),
        ("exception", Fallback(FallbackKind.EXCEPTION)),
        ("-1", Fallback(FallbackKind.VALUE, -1)),
        ("2.5", Fallback(FallbackKind.VALUE, 2.5)),
        ("true", Fallback(FallbackKind.VALUE, True)),
    ],
)
def test_policies(text: str, fallback: Fallback) -> None:
    assert read(scalars.OutputPolicy, text) == fallback


def test_a_misspelt_policy_is_suggested() -> None:
    assert refused(scalars.OutputPolicy, "excepton")[2] == "did you mean `exception`?"
    assert refused(scalars.OutputPolicy, "nothing")[2] == "write clear, hold, exception or a value"


def test_inputs_know_no_exception() -> None:
    """An exception is an answer to a reader; the robot reads nothing."""
    assert refused(scalars.ReleasePolicy, "exception")[0] == "bad-choice"


@pytest.mark.parametrize("text", ["9a", "a-b", "a b", "ä", "a" * 65])
def test_refused_names(text: str) -> None:
    assert refused(scalars.Name, text)[0] == "bad-name"


KINDS: list[Any] = [
    Address,
    RobotReference,
    Version,
    scalars.CellName,
    scalars.Duration,
    scalars.Listen,
    scalars.Name,
    scalars.Names,
    scalars.Networks,
    scalars.OptionalDuration,
    scalars.OutputPolicy,
    scalars.Real,
    scalars.ReleasePolicy,
    scalars.Whole,
]
plain_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(st.sampled_from("0129.:[]/-xyeE_ms% ")),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=5,
)


@given(st.sampled_from(KINDS), plain_values)
def test_nothing_raises_but_what_is_invalid(kind: Any, value: object) -> None:
    """Whatever stands in the place of a value is read or refused."""
    with contextlib.suppress(Invalid):
        tables.read(kind, value)
