"""Answers in words."""

from __future__ import annotations

import re
from typing import Any

import pytest

from gatewayd.cli.phrases import clock, owner, places

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


def test_places() -> None:
    assert places({"modbus": [{"notation": "400101"}, {"notation": "300008"}]}) == "400101 300008"
    assert places({"modbus": [], "canopen": {"object": "2010h:01", "type": "REAL32"}}) == "2010h:01"
    assert places({"modbus": [], "canopen": None}) == ""


def test_the_clock_has_no_date() -> None:
    assert re.fullmatch(r"\d\d:\d\d:\d\d", clock("2027-01-15T08:00:05.000Z"))
