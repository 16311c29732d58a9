"""Values as JSON and commands from it, with any bytes."""

from __future__ import annotations

import json
import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.image import Quality
from gatewayd.links.mqtt.payload import CellCommand, CommandError, decode_command, encode, utc, value_fields
from gatewayd.links.mqtt.publisher import ValueSample

AHEAD = 1_800_000_000.0


def said(value: bool | float | None, quality: Quality = Quality.GOOD, time: float = 1.5) -> object:
    return json.loads(encode(value_fields(ValueSample("speed", 0, value, quality, time), AHEAD, "m/s")))


def test_a_value_has_its_quality_and_the_time_of_its_source() -> None:
    assert said(0.5) == {"value": 0.5, "quality": "good", "time": "2027-01-15T08:00:01.500Z", "unit": "m/s"}
    assert said(None, Quality.NEVER, -math.inf) == {
        "value": None,
        "quality": "never",
        "time": None,
        "unit": "m/s",
    }


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_json_has_no_nan(value: float) -> None:
    assert said(value) == {
        "value": None, "special": str(value), "quality": "good", "time": "2027-01-15T08:00:01.500Z", "unit": "m/s",
    }  # fmt: skip


def test_times_of_broken_clocks() -> None:
    assert utc(-5.0) == "1970-01-01T00:00:00.000Z"
    assert utc(1e18) == "9999-12-31T23:59:59.000Z"


def test_commands() -> None:
    assert decode_command(b"{}") == CellCommand()
    assert decode_command(b'{"id":7,"write":{"a":1}}') == CellCommand(7, {"a": 1})
    assert decode_command(b'{"release":"all"}') == CellCommand(release_all=True)
    assert decode_command(b'{"release":"a"}') == CellCommand(release=["a"])
    assert decode_command(b'{"request":["a","b"]}') == CellCommand(request=["a", "b"])


@pytest.mark.parametrize(
    "payload, why",
    [
        (b"{", "not JSON"),
        (b'"on"', "not an object"),
        (b'{"write":{"a":1},"release":"a"}', "one of write, request and release"),
        (b'{"write":[1]}', "`write` is no object"),
        (b'{"request":[]}', "`request` is no name"),
        (b'{"request":[1]}', "something that is no name"),
        (b'{"id":true}', "`id` is no text or number"),
        (b'{"id":"%s"}' % (b"x" * 101), "`id` is no text or number"),
        (b'{"set":1}', "unknown key 'set'"),
        (b'{"write":{"a":Infinity}}', "Infinity is no JSON"),
        (b'{"id":' + b"9" * 5000 + b"}", "not JSON"),
    ],
)
def test_what_is_no_command(payload: bytes, why: str) -> None:
    with pytest.raises(CommandError, match=why):
        decode_command(payload)


@given(st.binary(max_size=200))
def test_any_bytes(payload: bytes) -> None:
    with suppress(CommandError):
        decode_command(payload)


_KEYS = st.sampled_from(["write", "id", "request", "release", "x"])
_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_KEYS, inner, max_size=3),
)


@given(_JSON)
def test_any_json(found: object) -> None:
    with suppress(CommandError):
        decode_command(json.dumps(found).encode())
