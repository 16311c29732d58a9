"""The small languages inside a mapping."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from gatewayd.core.definition import Fallback, FallbackKind
from gatewayd.mapping import scalars
from gatewayd.mapping.source import parse, plain


def written(text: str) -> object:
    """What YAML makes of the text of a value."""
    source = parse(f"a: {text}".encode(), "f")
    assert source.root is not None, source.findings
    value = plain(source.root)
    assert isinstance(value, dict)
    return value["a"]


def read(kind: Any, text: str) -> Any:
    return TypeAdapter(kind).validate_python(written(text), strict=True)


def refused(kind: Any, text: str) -> tuple[str, str, str]:
    """Rule, message and hint of the refusal."""
    with pytest.raises(ValidationError) as caught:
        read(kind, text)
    details = caught.value.errors()[0]
    return details["type"], details["ctx"]["message"], details["ctx"]["hint"]


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
    "text, address",
    [("0", (0, None)), ("65535", (65535, None)), ("0.10", (0, 10)), ("0.1", (0, 1)), ("'12.15'", (12, 15))],
)
def test_addresses(text: str, address: tuple[int, int | None]) -> None:
    """The text counts: `0.10` is bit 10, not bit 1."""
    assert read(scalars.Address, text) == address


@pytest.mark.parametrize(
    "text, slug",
    [
        ("-1", "bad-address"),
        ("0x10", "bad-address"),
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
    assert refused(scalars.Address, text)[0] == slug


@pytest.mark.parametrize(
    "digits, hint", [("400101", "{holding: 100}"), ("300001", "{input: 0}"), ("100008", "{discrete: 7}")]
)
def test_six_digit_notation_is_explained(digits: str, hint: str) -> None:
    """4xxxxx is never guessed, but the finding says what to write."""
    assert hint in refused(scalars.Address, digits)[2]


def test_references() -> None:
    one = read(scalars.RobotReference, "input_int_register_0")
    assert (one.field, one.registers, one.many) == ("input_int_register_0", None, False)
    family = read(scalars.RobotReference, "output_double_register_0..23")
    assert (family.field, family.registers, family.many) == ("output_double_register_", range(24), True)
    element = read(scalars.RobotReference, "'actual_TCP_pose[2]'")
    assert (element.field, element.elements, element.many) == ("actual_TCP_pose", range(2, 3), False)
    bits = read(scalars.RobotReference, "actual_digital_input_bits.0..7")
    assert (bits.field, bits.bits, bits.many) == ("actual_digital_input_bits", range(8), True)


@pytest.mark.parametrize(
    "text, slug",
    [
        ("5", "bad-robot-reference"),
        ("'x[a]'", "bad-robot-reference"),
        ("x..3", "bad-robot-reference"),
        ("'x[0..1].0..3'", "bad-robot-reference"),
        ("a b", "bad-robot-reference"),
        ("x_7..3", "bad-range"),
        ("[x]", "wrong-type"),
    ],
)
def test_refused_references(text: str, slug: str) -> None:
    assert refused(scalars.RobotReference, text)[0] == slug


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
    networks = read(scalars.Networks, "[192.168.1.20, 10.0.0.0/8, 'fe80::/64']")
    assert [str(network) for network in networks] == ["192.168.1.20/32", "10.0.0.0/8", "fe80::/64"]
    assert len(read(scalars.Networks, "192.168.1.20")) == 1


@pytest.mark.parametrize(
    "text, hint",
    [("192.168.1.5/24", "192.168.1.0/24"), ("plc", "write an address"), ("[]", "name at least one")],
)
def test_refused_networks(text: str, hint: str) -> None:
    assert hint in refused(scalars.Networks, text)[2]


@pytest.mark.parametrize(
    "text, version",
    [("5.12", (5, 12, 0)), ("5.10", (5, 10, 0)), ("10", (10, 0, 0)), ("'5.9.4.1031110'", (5, 9, 4))],
)
def test_versions(text: str, version: tuple[int, int, int]) -> None:
    """5.10 is version ten, not one."""
    assert read(scalars.Version, text) == version


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


def test_inputs_know_no_exception() -> None:
    """An exception is an answer to a reader; the robot reads nothing."""
    assert refused(scalars.ReleasePolicy, "exception")[0] == "bad-choice"


@pytest.mark.parametrize("text", ["9a", "a-b", "a b", "ä", "a" * 65])
def test_refused_names(text: str) -> None:
    assert refused(scalars.Name, text)[0] == "bad-name"


KINDS: list[Any] = [
    scalars.Address,
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
    scalars.RobotReference,
    scalars.Version,
    scalars.Whole,
]
ADAPTERS: list[TypeAdapter[Any]] = [TypeAdapter(kind) for kind in KINDS]
plain_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(st.sampled_from("0129.:[]/-xyeE_ms% ")),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=5,
)


@given(st.sampled_from(ADAPTERS), plain_values)
def test_nothing_raises_but_a_validation_error(adapter: TypeAdapter[Any], value: object) -> None:
    """Whatever stands in the place of a value is read or refused."""
    with contextlib.suppress(ValidationError):
        adapter.validate_python(value, strict=True)
