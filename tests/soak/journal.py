"""What the writers of a soak run wrote, each in a file of its own, one line for each writing and each answer.

A line is `TIME FIELD VALUE OUTCOME`: monotonic time, field of the robot, and -1 for what is about to be sent, else the
exception code that came as the answer, 0 for none.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

SENT = -1


class Entry(NamedTuple):
    """One line."""

    time: float
    field: str
    value: float
    outcome: int


class Journal:
    """Written without a buffer: whoever is killed leaves whole lines."""

    def __init__(self, path: str) -> None:
        self._file = Path(path).open("ab", buffering=0)  # noqa: SIM115 - for as long as the process lives

    def note(self, field: str, value: float, outcome: int = SENT) -> None:
        """Add a line of this moment."""
        self._file.write(f"{time.monotonic():.6f} {field} {value} {outcome}\n".encode())


def entries(path: Path) -> Iterator[Entry]:
    """The lines of a file, none if there is no such file."""
    if not path.exists():
        return
    for line in path.read_text("ascii").splitlines():
        moment, field, value, outcome = line.split()
        yield Entry(float(moment), field, float(value), int(outcome))
