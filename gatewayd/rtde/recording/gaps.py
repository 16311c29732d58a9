"""What is missing in a recording: found by the controller's timestamps, and kept in a file beside it.

The recording itself has packages only, so that every reader takes it. `robot_data.csv.gaps.jsonl` has one JSON object
on a line for each gap; without a gap there is no such file.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording.errors import RecordingError, RecordingExistsError
from gatewayd.rtde.recording.row_file import RowFile

SUFFIX = ".gaps.jsonl"
"""What is added to the name of the recording."""

_TIMESTAMP = "timestamp"
_LATE = 1.5
"""Periods between two packages from which on one is missing."""
_MAX_BYTES = 1 << 26


@dataclass(frozen=True, slots=True)
class RecordedGap:
    """Packages that a recording lacks."""

    package: int
    """Number of the first package behind the gap, counted from 0."""
    reason: str
    """`skipped`, `timestamp went back`, or why the robot was lost, in words."""
    missing: int | None = None
    """How many packages; None: not known, as after a restart of the controller."""
    before: float | None = None
    """The controller's timestamp of the last package before it, in seconds."""
    after: float | None = None
    """... and of the first one behind it."""
    host_time: float | None = None
    """When that one was received, in seconds since 1970 UTC; None in a recording without host time."""


class GapWatch:
    """Finds gaps by the timestamps of the packages, which are shown to it in their order.

    `period` is the time between two packages in seconds. Without it, or without `timestamp` in the recipe, only losses
    are found that were reported.
    """

    def __init__(self, recipe: Recipe, period: float | None) -> None:
        self._period = period
        slot = recipe.slots.get(_TIMESTAMP)
        self._place = slot.start if slot is not None else None
        self._last: float | None = None
        self._lost = ""
        self._packages = 0

    def lost(self, reason: str) -> None:
        """The robot was lost, for this reason in words; the gap ends with the next package."""
        self._lost = reason

    def check(self, values: Sequence[Scalar], host_time: float | None = None) -> RecordedGap | None:
        """Take in a package; the gap before it, if there is one."""
        before, self._last = self._last, None if self._place is None else float(values[self._place])
        number, self._packages = self._packages, self._packages + 1
        reason, self._lost = self._lost, ""
        if number == 0:
            return None
        missing = self._missing(before, self._last)
        if self._place is None and reason:
            missing = None
        if not reason:
            if missing == 0:
                return None
            reason = "timestamp went back" if missing is None else "skipped"
        return RecordedGap(number, reason, missing, before, self._last, host_time)

    def _missing(self, before: float | None, after: float | None) -> int | None:
        """How many are missing between two timestamps; None: the controller's clock began anew in between."""
        if before is None or after is None:
            return 0
        if not before <= after < math.inf:
            return None
        if self._period is None or after - before < _LATE * self._period:
            return 0
        return round((after - before) / self._period) - 1


class GapWriter:
    """Writes the file beside a recording, once there is a first gap. As a context manager it is closed at the end."""

    def __init__(self, recording: str | Path, *, overwrite: bool = False) -> None:
        """Prepare it; with `overwrite` the file of an earlier recording goes.

        Raises RecordingExistsError where one stays, RecordingError where it cannot be removed.
        """
        self._path = f"{recording}{SUFFIX}"
        self._file: RowFile | None = None
        self.count = 0
        """Gaps."""
        self.missing = 0
        """Packages missing in them, as far as it is known."""
        if overwrite:
            try:
                Path(self._path).unlink(missing_ok=True)
            except (OSError, ValueError) as error:
                raise RecordingError(f"{self._path}: cannot be removed: {error}") from error
        elif os.path.lexists(self._path):
            raise RecordingExistsError(self._path)

    def write(self, gap: RecordedGap) -> None:
        """Add a gap. Raises RecordingError for a full disk."""
        if self._file is None:
            self._file = RowFile(self._path)
        shown = {name: found for name, found in asdict(gap).items() if found is not None}
        self._file.append(json.dumps(shown).encode() + b"\n")
        self.count += 1
        self.missing += gap.missing or 0

    def close(self) -> None:
        """Close the file; a second time does nothing."""
        if self._file is not None:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()


def read_gaps(recording: str | Path) -> tuple[RecordedGap, ...]:
    """The gaps of a recording; none without a file of them. A last line that is not whole is left out.

    Raises RecordingError for a file that cannot be read.
    """
    path = f"{recording}{SUFFIX}"
    try:
        with Path(path).open("rb") as file:
            data = file.read(_MAX_BYTES)
    except FileNotFoundError:
        return ()
    except (OSError, ValueError) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error
    lines = data.split(b"\n")[:-1]
    return tuple(_gap(path, number, line) for number, line in enumerate(lines, 1))


def _gap(path: str, number: int, line: bytes) -> RecordedGap:
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict) or not _fits(found):
        raise RecordingError(f"{path}:{number}: is no gap of a recording; strike the line")
    return RecordedGap(**{name: value for name, value in found.items() if name in _KINDS})


def _fits(found: dict[str, Any]) -> bool:
    return {"package", "reason"} <= set(found) and all(
        isinstance(value, _KINDS[name]) for name, value in found.items() if name in _KINDS
    )


_KINDS: dict[str, tuple[type, ...]] = {
    "package": (int,),
    "reason": (str,),
    "missing": (int,),
    "before": (int, float),
    "after": (int, float),
    "host_time": (int, float),
}
"""What a line of the file may have, and of which kind."""
