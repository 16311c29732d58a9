"""Answers in words."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.cli.phrases import clock, owner, places, value

FREE = {"direction": "input", "owner": None, "lease": None, "forced": None}


@pytest.mark.parametrize(
    "variable, text",
    [
        (FREE, "free"),
        ({**FREE, "owner": "plc"}, "plc"),
        ({**FREE, "owner": "plc", "lease": 4.2}, "plc, 4.2 s left"),
        ({**FREE, "direction": "output"}, "robot"),
        ({**FREE, "owner": "operator", "lease": 30.0, "forced": {"remaining": 30.0}}, "forced, 30.0 s left"),
    ],
)
def test_owners(variable: dict[str, Any], text: str) -> None:
    assert owner(variable) == text


def test_a_forced_value_has_its_truth_beside_it() -> None:
    reported = {"remaining": 30.0, "reported": 7, "reported_quality": "good"}
    variable = {**FREE, "direction": "output", "unit": "", "meanings": {"7": "running"}, "forced": reported}
    assert owner(variable) == "forced, 30.0 s left; reports 7 running"
    reported["reported_quality"] = "stale"
    assert owner(variable) == "forced, 30.0 s left; reports 7 running, stale"
    assert owner({**variable, "direction": "input"}) == "forced, 30.0 s left; robot holds 7 running, stale"
    input_forced = {"remaining": 30.0, "reported": None, "reported_quality": None}
    assert owner({**FREE, "forced": input_forced}) == "forced, 30.0 s left"


def test_a_state_has_its_number_and_its_word() -> None:
    assert value({"value": 5, "unit": "", "meanings": {"5": "safeguard stop"}}) == "5 safeguard stop"
    assert value({"value": 6, "unit": "", "meanings": {"5": "safeguard stop"}}) == "6"
    assert value({"value": 2.5, "unit": "N", "meanings": None}) == "2.5 N"
    assert value({"value": True, "unit": "", "meanings": {"1": "fault"}}) == "1 fault"
    assert value({"value": 3, "unit": "", "bits": {"0": "power on"}}) == "3 power on, bit 1"


def test_places() -> None:
    assert places({"modbus": [{"notation": "400101"}, {"notation": "300008"}]}) == "400101 300008"
    assert places({"modbus": [], "canopen": {"object": "2010h:01", "type": "REAL32"}}) == "2010h:01"
    assert places({"modbus": [], "canopen": None}) == ""


def test_the_clock_is_that_of_the_log_without_the_date() -> None:
    assert clock("2027-01-15T08:00:05.120Z") == "08:00:05.120Z"
