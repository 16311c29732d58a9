"""Every state has words and a colour."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import Level
from gatewayd.report.words import (
    LEVEL_COLOURS,
    QUALITY_COLOURS,
    SOURCE_LEVELS,
    SOURCES,
    meaning,
    quality,
    source,
)


def test_every_state_has_words_and_a_level() -> None:
    assert set(SOURCES) == set(SOURCE_LEVELS) == set(Source)
    assert [state for state, level in SOURCE_LEVELS.items() if level is Level.GOOD] == [Source.FRESH]


def test_everything_has_a_colour() -> None:
    assert set(QUALITY_COLOURS) == set(Quality)
    assert set(LEVEL_COLOURS) == set(Level)


def test_names_of_the_control_interface_lead_back() -> None:
    assert quality("out_of_range") is Quality.OUT_OF_RANGE
    assert source("lost") is Source.LOST


MODE: dict[str, Any] = {"meanings": {"7": "running"}, "bits": None}
BIT: dict[str, Any] = {"meanings": {"0": "power off", "1": "power on"}, "bits": None}
WORD: dict[str, Any] = {
    "meanings": None,
    "bits": {"0": "normal mode", "2": "protective stopped", "9": "fault"},
}
MEANT = [
    (7, MODE, "running"),
    (8, MODE, ""),
    (True, BIT, "power on"),
    (False, BIT, "power off"),
    (1, WORD, "normal mode"),
    (0b10_0000_0100, WORD, "protective stopped, fault"),
    (0b1000_0000_0000_0101, WORD, "normal mode, protective stopped, bit 15"),
    (2**31, WORD, "bit 31"),
    (0, WORD, "no bit is 1"),
    ("nan", WORD, ""),
    (2.5, {}, ""),
]
"""A value, what is declared of its variable, and what it stands for."""


@pytest.mark.parametrize("value, declared, words", MEANT)
def test_states_and_bits_in_words(value: object, declared: dict[str, Any], words: str) -> None:
    assert meaning(value, declared) == words
