"""Figures for people."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gatewayd.report.format import (
    address,
    age,
    ago,
    counted,
    exact,
    interval,
    listed,
    parse_address,
    plural,
    seconds,
    span,
    split_address,
    value,
    verb,
)


@pytest.mark.parametrize(
    "found, unit, text",
    [
        (True, "", "1"), (False, "", "0"), (7, "", "7"), (0.1 + 0.2, "N", "0.3 N"), (-2.0, "", "-2"), (0.0, "", "0"),
        (0.12345, "", "0.123"), (47.5, "N", "47.5 N"), (0.00012, "", "0.00012"), (1e300, "", "1e+300"),
        (math.nan, "N", "nan N"), (-math.inf, "", "-inf"), ("nan", "", "nan"),
    ],
)  # fmt: skip
def test_values_are_short_and_have_their_unit(found: object, unit: str, text: str) -> None:
    assert value(found, unit) == text


@pytest.mark.parametrize(
    "seconds, text",
    [(None, "-"), (math.inf, "-"), (-0.001, "0 ms"), (0.012, "12 ms"), (3.44, "3.4 s"), (75, "1 min 15 s")],
)
def test_ages(seconds: float | None, text: str) -> None:
    assert age(seconds) == text


@pytest.mark.parametrize(
    "seconds, text",
    [
        (-1, "0 s"), (0, "0 s"), (4.9999, "5 s"), (59, "59 s"), (3600, "1 h"), (7980, "2 h 13 min"),
        (266400, "3 d 2 h"),
    ],
)  # fmt: skip
def test_spans_have_two_units_at_most(seconds: float, text: str) -> None:
    assert span(seconds) == text


def test_nouns_agree_with_their_count() -> None:
    assert [counted(count, "lock") for count in (0, 1, 2)] == ["no locks", "1 lock", "2 locks"]


NOUNS = st.sampled_from(
    ["lock", "entry", "key", "switch", "index", "bus", "strange package", "PDO", "mapping file"]
)
VERBS = {
    "hold": "holds",
    "own": "owns",
    "be": "is",
    "have": "has",
    "fall": "falls",
    "go": "goes",
    "pass": "passes",
}


@given(st.integers(0, 10**9), NOUNS)
def test_a_count_of_one_alone_has_the_singular(count: int, noun: str) -> None:
    words = counted(count, noun).split(" ", 1)
    assert words == [str(count) if count else "no", noun if count == 1 else plural(noun)]
    assert plural(noun) != noun


def test_plurals() -> None:
    nouns = ["lock", "entry", "key", "switch", "bus", "index"]
    assert [plural(noun) for noun in nouns] == ["locks", "entries", "keys", "switches", "buses", "indexes"]


@given(st.sampled_from(sorted(VERBS)), st.text(), st.integers(0, 100))
def test_verbs_agree_with_names_and_counts(base: str, name: str, count: int) -> None:
    """Third person for one of any name but `you`; the plural for `you`, for none and for several."""
    if count == 1 and name.casefold() != "you":
        assert verb(base, name, count) == VERBS[base]
    else:
        assert verb(base, name, count) == {"be": "are"}.get(base, base)
    assert verb(base, "you") == verb(base, name, 2)


@example(0.0005)
@given(st.floats(allow_nan=False) | st.none())
def test_no_age_is_a_zero(duration: float | None) -> None:
    text = ago(duration)
    assert text in ("just now", "never") or (text.endswith(" ago") and float(text.split()[0]) > 0)


def test_many_names_are_a_few_and_a_number() -> None:
    assert listed(["a", "b"], 3) == "a, b"
    assert listed(list("abcde"), 3) == "a, b, c and 2 more"


def test_numbers_of_mappings_keep_every_digit() -> None:
    assert (exact(0.1), exact(5.0), exact(1e-7)) == ("0.1", "5", "1e-07")
    assert (seconds(2.0), seconds(None)) == ("2 s", "")


def test_an_interval_has_every_digit() -> None:
    assert interval(0, 150.0) == "0..150"
    assert interval(-0.0505, 1234567.5) == "-0.0505..1234567.5"


@given(
    st.one_of(st.ip_addresses().map(str), st.from_regex(r"[a-z0-9.-]+", fullmatch=True)),
    st.integers(0, 65535),
)
def test_an_address_is_read_as_it_is_written(host: str, port: int) -> None:
    assert split_address(address(host, port)) == parse_address(address(host, port)) == (host, port)


@pytest.mark.parametrize(
    "text, found",
    [
        ("robot", ("robot", None)), ("::1", ("::1", None)), ("[::1]", ("::1", None)),
        ("fe80::1%eth0", ("fe80::1%eth0", None)),
        ("[fe80::1%eth0]:7", ("fe80::1%eth0", 7)), ("a:99999", ("a", 99999)), ("::1:9502", ("::1:9502", None)),
        ("", None), ("a:", None), (":1", None), ("a:b", None), ("a:-1", None), ("a:\u0663", None), ("a:123456", None),
        ("http://a", None), ("http://a:1", None), ("a b", None), ("[::1", None), ("[robot]:1", None), ("a:1\n", None),
    ],
)  # fmt: skip
def test_host_and_port_are_found_where_they_are(text: str, found: tuple[str, int | None] | None) -> None:
    assert split_address(text) == found


@pytest.mark.parametrize(
    "text, default", [("a", None), ("a:65536", None), ("a:65536", 502), ("a:0", 502), ("", 502)]
)
def test_what_is_no_address_is_answered_with_examples(text: str, default: int | None) -> None:
    with pytest.raises(ValueError, match=r"is not HOST.*:PORT, say .* or .*"):
        parse_address(text, default)


def test_a_port_may_be_omitted_where_there_is_a_usual_one() -> None:
    assert parse_address("a", 502) == ("a", 502)
