"""The last minute of a cell's values, so that the page knows what was before it was opened. Pure, and bounded."""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from gatewayd.core.cell import Cell

SECONDS = 60.0
PERIOD = 0.5
"""Seconds between two samples of a cell with up to `MAX_VALUES` variables."""
MAX_VALUES = 1024
"""Variables of a sample on average: a cell with more is sampled less often, so that none costs more than 1.2 MB."""
_EARLY = 0.5 * PERIOD


@dataclass(frozen=True, slots=True)
class HistoryRow:
    """All values of one moment."""

    time: float
    values: array[float]
    """By variable; 0 and 1 for bits."""
    quality: bytes
    """By variable, as `Quality` numbers them."""


class LastMinute:
    """Samples of one cell, oldest first. A mapping of other variables begins anew."""

    def __init__(self) -> None:
        self._samples: deque[HistoryRow] = deque(maxlen=round(SECONDS / PERIOD))
        self._fingerprint = -1
        self.period = PERIOD

    @property
    def samples(self) -> Sequence[HistoryRow]:
        """A copy."""
        return tuple(self._samples)

    def look(self, cell: Cell, now: float) -> None:
        """Keep what the cell shows now, if it is time. To be called every `PERIOD`."""
        values = cell.image.values
        if cell.definition.fingerprint != self._fingerprint:
            self._samples.clear()
            self._fingerprint = cell.definition.fingerprint
            self.period = PERIOD * -(-max(1, len(values)) // MAX_VALUES)
        if self._samples and now - self._samples[-1].time < self.period - _EARLY:
            return
        while self._samples and now - self._samples[0].time > SECONDS:
            self._samples.popleft()
        self._samples.append(HistoryRow(now, array("d", values), bytes(cell.image.quality)))
