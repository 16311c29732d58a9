"""Every state has words and a colour."""

from __future__ import annotations

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import Level
from gatewayd.report.words import (
    LEVEL_COLOURS,
    QUALITY_COLOURS,
    SOURCE_LEVELS,
    SOURCES,
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
