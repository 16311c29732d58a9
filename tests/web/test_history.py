"""What the gateway keeps of the last minute."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.core.cell import Cell
from gatewayd.web import history
from gatewayd.web.history import PERIOD, SECONDS, LastMinute
from tests.web.press import CYCLES, FORCE_LIMIT, SPARE, START


def test_a_sample_has_every_value_with_its_quality(cell: Cell) -> None:
    kept = LastMinute()
    kept.look(cell, 100.0)
    [sample] = kept.samples
    assert sample.time == 100.0
    assert (sample.values[START], sample.values[FORCE_LIMIT]) == (1.0, 12.5)
    assert (sample.quality[CYCLES], sample.quality[SPARE]) == (0, 2)


def test_a_minute_is_kept_and_no_more(cell: Cell) -> None:
    kept = LastMinute()
    for number in range(1000):
        kept.look(cell, 100.0 + number * PERIOD)
    times = [sample.time for sample in kept.samples]
    assert len(times) == SECONDS / PERIOD
    assert times[-1] - times[0] <= SECONDS
    kept.look(cell, 10_000.0)
    assert len(kept.samples) == 1, "what is older than a minute goes, also after a pause"


def test_other_variables_begin_anew(cell: Cell) -> None:
    kept = LastMinute()
    kept.look(cell, 100.0)
    cell.definition = replace(cell.definition, fingerprint=7)
    kept.look(cell, 100.5)
    assert [sample.time for sample in kept.samples] == [100.5]


def test_a_large_cell_is_sampled_less_often(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history, "MAX_VALUES", 5)
    kept = LastMinute()
    for number in range(8):
        kept.look(cell, 100.0 + number * PERIOD)
    assert kept.period == 2 * PERIOD
    assert len(kept.samples) == 4
