"""When a process of the rig wanted the processor and did not get it: on a shared machine it stands still unasked."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.soak.truth import Stop

_LOOK = 0.02
"""Seconds between two looks."""
_MIN = 0.02
"""Seconds of waiting between two looks from which on it counts."""


class Starvation(threading.Thread):
    """Adds to `stops` from `start` until `stop`; `pids` are the processes that there are now."""

    def __init__(self, pids: Callable[[], Sequence[int]], stops: list[Stop]) -> None:
        super().__init__(daemon=True)
        self._pids = pids
        self._stops = stops
        self._over = threading.Event()
        self._waited: dict[int, float] = {}

    def run(self) -> None:
        before = time.monotonic()
        while not self._over.wait(_LOOK):
            waited = {pid: _waited(pid) for pid in self._pids()}
            now = time.monotonic()
            if any(value - self._waited.get(pid, value) > _MIN for pid, value in waited.items()):
                self._stops.append(Stop(before, now))
            before, self._waited = now, waited

    def stop(self) -> None:
        self._over.set()
        self.join()


def _waited(pid: int) -> float:
    """Seconds for which the process was ready to run and did not (the second number of schedstat)."""
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text("ascii").split()[1]) / 1e9
    except (OSError, IndexError):
        return 0.0
