"""Columns and lines of the table of `gatewayd watch`."""

from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from gatewayd.cli.watch_table import layout

VARIABLE: dict[str, Any] = {
    "cell": "press-3",
    "name": "speed_of_the_conveyor_belt_at_infeed",
    "direction": "output",
    "robot": "output_double_register_3",
    "value": 1234567890,
    "unit": "mm/s",
    "quality": "out_of_range",
    "age": 12.3,
    "owner": None,
    "lease": None,
    "forced": {"remaining": 30.0, "reported": 1234567891, "reported_quality": "stale"},
    "modbus": [{"notation": "400101"}, {"notation": "300008"}],
    "canopen": {"object": "2010h:01"},
}
STOPS = {**VARIABLE, "name": "stops", "value": 0x24, "unit": "", "forced": None} | {
    "bits": {"2": "protective stopped", "5": "system emergency stopped"}
}
ENDLESS = {**VARIABLE, "name": "x" * 60, "value": 7, "forced": None}
VARIABLES = [VARIABLE, STOPS, ENDLESS]


def drawn(width: int, *, several: bool = False) -> list[str]:
    found = layout(VARIABLES, width, several=several)
    console = Console(width=width, force_terminal=False)
    with console.capture() as captured:
        console.print(found.table(VARIABLES, {}, ""))
    lines = captured.get().rstrip("\n").split("\n")
    assert len(lines) == 2 + sum(map(found.height, VARIABLES))
    return lines


@pytest.mark.parametrize("width", [40, 60, 72, 80, 100, 120, 140])
@pytest.mark.parametrize("several", [False, True])
def test_nothing_is_cut_and_no_number_broken(width: int, *, several: bool) -> None:
    lines = drawn(width, several=several)
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    assert "\u2026" not in text
    for whole in ("1234567890", "1234567891", "protective", "emergency", "conveyor_", "30.0", "12.3"):
        assert whole in text
    assert text.count("x") >= 60


@pytest.mark.parametrize(
    "width, left_out",
    [
        (40, ("places", "robot register")),
        (80, ("places", "robot register")),
        (100, ("robot register",)),
        (140, ()),
    ],
)
def test_what_has_no_room_is_named(width: int, left_out: tuple[str, ...]) -> None:
    found = layout([STOPS], width, several=False)
    assert found.left_out == left_out
    assert not found.widths.keys() & set(left_out)


def test_as_many_are_shown_as_have_room_and_at_least_one() -> None:
    found = layout(VARIABLES, 40, several=False)
    heights = list(map(found.height, VARIABLES))
    assert found.shown(VARIABLES, sum(heights)) == 3
    assert found.shown(VARIABLES, sum(heights) - 1) == 2
    assert found.shown(VARIABLES, 1) == 1
    assert found.shown([], 5) == 0
