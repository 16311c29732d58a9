"""Answers in words."""

from __future__ import annotations

import pytest

from gatewayd.cli import phrases


@pytest.mark.parametrize(
    "found, unit, text",
    [
        (True, "", "1"), (False, "", "0"), (7, "", "7"), (0.1 + 0.2, "N", "0.3 N"), (-2.0, "", "-2"), (0.0, "", "0"),
        (0.00012, "", "0.00012"), (1e300, "", "1e+300"), ("nan", "", "nan"),
    ],
)  # fmt: skip
def test_values(found: object, unit: str, text: str) -> None:
    assert phrases.value(found, unit) == text


@pytest.mark.parametrize(
    "seconds, text", [(None, "-"), (0.012, "12 ms"), (3.44, "3.4 s"), (75, "1 min 15 s")]
)
def test_ages(seconds: float | None, text: str) -> None:
    assert phrases.age(seconds) == text


@pytest.mark.parametrize(
    "seconds, text", [(0, "0 s"), (59, "59 s"), (3600, "1 h"), (7980, "2 h 13 min"), (266400, "3 d 2 h")]
)
def test_spans_have_two_units_at_most(seconds: float, text: str) -> None:
    assert phrases.span(seconds) == text


@pytest.mark.parametrize(
    "found, text",
    [
        ({"event": "write refused", "writer": "hmi", "variable": "x", "new": 7, "other": "plc", "repeats": 2},
         "hmi wrote x = 7: refused, held by plc (3 times)"),
        ({"event": "write refused", "writer": "undeclared", "reason": "no variable at this address"},
         "undeclared wrote an address: refused, no variable at this address"),
        ({"event": "lock acquired", "writer": "operator", "lock": "m", "detail": "by x"}, "operator took m (by x)"),
        ({"event": "lock taken over", "writer": "plc", "lock": "m", "other": "hmi"}, "plc took m over from hmi"),
        ({"event": "lock released", "writer": "plc", "lock": "m", "detail": "lease ended"}, "plc lost m: lease ended"),
        ({"event": "fallback applied", "variable": "x", "old": 3, "new": 0}, "x fell back from 3 to 0"),
        ({"event": "force ended", "variable": "x", "detail": "time limit"}, "x is no longer forced: time limit"),
        ({"event": "writer lost", "writer": "plc", "detail": "closed"}, "plc lost: closed"),
        ({"event": "robot lost", "detail": "gone"}, "robot lost: gone"),
        ({"event": "register unavailable", "variable": "x", "detail": "IN_USE"}, "register unavailable x: IN_USE"),
    ],
)  # fmt: skip
def test_events(found: dict[str, object], text: str) -> None:
    assert phrases.event(found) == text


def test_records() -> None:
    accepted = {"what": "write accepted", "writer": "plc", "variable": "x", "old": 1, "new": 2}
    assert phrases.record(accepted) == "plc wrote x: 1 -> 2"
    assert phrases.record({**accepted, "times": 5}) == "plc wrote x: 1 -> 2 (5 changes)"
    refused = {"what": "write refused", "writer": "hmi", "variable": "x", "new": 2, "holder": "plc"}
    assert phrases.record(refused) == "hmi wrote x = 2: refused, held by plc"
