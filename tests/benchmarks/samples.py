"""Samples that are repeated while something else than the benchmark had the machine, and what that came to."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

from tests.benchmarks.usage import Usage, usage

STEAL = 0.01
"""Share of one core that the hypervisor may take in a sample."""
OTHERS = 0.1
"""Share of one core that processes which are no part of the benchmark may take."""
REPEATS = 2
"""Times that one sample is repeated."""
MOST_REPEATS = 20
"""Of one subject, so that a machine that is never quiet costs no more than this."""
NOISE = ("steal", "others", "switches/s")
"""Columns of `noise`."""

RULE = f"""\
Beside each row: CPU time that the hypervisor took (steal) and that other processes took, as a share of one core, and
how often a second the server was taken from its core; the greatest of its samples. A sample with more than
{STEAL:.0%} of steal or {OTHERS:.0%} of others is disturbed: it is repeated, {REPEATS} times at most, and the quietest
one counts."""

T = TypeVar("T")


class Samples:
    """The samples of one subject. `look` reads what the process and the machine have used."""

    def __init__(self, look: Callable[[int], Usage] = usage) -> None:
        self._look = look
        self._noise: dict[str, list[Usage]] = {}
        self.taken = 0
        self.left_out = 0
        """Samples that were repeated."""
        self.disturbed = 0
        """Samples that count though they are disturbed."""

    def take(self, row: str, server: int, measure: Callable[[], T]) -> T:
        """What `measure` returns, undisturbed if that can be had; its noise belongs to `row`. `server`: a process."""
        best: tuple[float, Usage, T] | None = None
        for attempt in range(1 + REPEATS):
            self.taken += 1
            before = self._look(server)
            result = measure()
            noise = self._look(server) - before
            if best is None or disturbance(noise) < best[0]:
                best = disturbance(noise), noise, result
            if best[0] <= 1 or attempt == REPEATS or self.left_out == MOST_REPEATS:
                break
            self.left_out += 1
        assert best is not None
        self.disturbed += best[0] > 1
        self._noise.setdefault(row, []).append(best[1])
        return best[2]

    def noise(self, row: str) -> tuple[str, str, str]:
        """Cells of NOISE."""
        found = self._noise.get(row, ())
        if not found:
            return "-", "-", "-"
        return (
            f"{max(one.steal / one.wall for one in found):.1%}",
            f"{max(0.0, *(one.others / one.wall for one in found)):.0%}",
            f"{max(one.switches / one.wall for one in found):.0f}",
        )

    @property
    def note(self) -> str:
        """What was left out, and whether what is left can be believed."""
        text = f"{self.left_out} of {self.taken} samples left out as disturbed"
        if self.disturbed:
            text += f"; {self.disturbed} that count are DISTURBED all the same: believe no tail of this run"
        return f"{text}; load {os.getloadavg()[0]:.1f}."


def disturbance(noise: Usage) -> float:
    """How disturbed a sample is; more than 1: it is to be repeated."""
    if noise.wall <= 0.0:
        return 0.0
    return max(noise.steal / noise.wall / STEAL, noise.others / noise.wall / OTHERS)
