"""A write that is made again and again: what it is to the cell is worked out once.

A PLC writes the same registers in every cycle, and owns them. Of such a request nothing is left to be judged but the
limits, and its variables, which mostly follow each other, are stored by slices. `PreparedWrite.write` does this, and
leaves everything else as it is: who is refused, takes a lock over, or is late is for `Cell.write` to say. Where it
does write, `Cell.write` would have come to the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby, zip_longest
from operator import le

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value, ValueKind, Variable
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester


class PreparedWrite:
    """A request that writes these inputs of one cell, each of them once."""

    def __init__(
        self, cell: Cell, variables: Sequence[int], bounds: Sequence[tuple[float, float]] = ()
    ) -> None:
        """ValueError for a variable that nobody may write, that is named twice, or that is a command.

        `bounds`: of the first variables, between which values the caller's are right; others are left to `Cell.write`.
        """
        declared = [cell.definition.variables[index] for index in variables]
        locks = {variable.lock for variable in declared}
        if None in locks or len(set(variables)) < len(declared):
            raise ValueError("such a request is refused")
        if any(variable.is_command for variable in declared):
            raise ValueError("whether a command acts, only `Cell.write` knows")
        self._cell = cell
        self._variables = tuple(variables)
        self._locks = sorted(lock for lock in locks if lock is not None)
        self._renewals = tuple(self._leased(self._locks))
        self._spans = tuple(
            (
                image,
                slice(first, first + image.stop - image.start),
                [Quality.GOOD] * (image.stop - image.start),
            )
            for first, image in _neighbours(variables)
        )
        own = [_bounds(cell, index, variable) for index, variable in zip(variables, declared, strict=True)]
        pairs = list(zip_longest(own, bounds, fillvalue=(-math.inf, math.inf)))
        self._lows = tuple(max(low, least) for (low, _), (least, _) in pairs)
        self._highs = tuple(min(high, greatest) for (_, high), (_, greatest) in pairs)
        self._owner: int | None = None
        """Who owned all the locks, with all the registers there, as long as neither of these has changed."""
        self._changes = (-1, -1)

    def write(self, requester: Requester, values: list[Value], now: float) -> bool:
        """Write the variables' values, each of its kind. False: nothing was done, it is for `Cell.write` to judge.

        ValueError for another number of values: stored by slices, they would move what lies behind them.
        """
        if len(values) != len(self._variables):
            raise ValueError("not one value for each variable")
        cell = self._cell
        cell.operator.release_expired(now)
        if not self._is_usual(requester):
            return False
        if not (all(map(le, self._lows, values)) and all(map(le, values, self._highs))):
            return False
        cell.writer_seen(requester, now, wrote=True)
        for locks, lease in self._renewals:
            cell.ownership.renew(locks, requester.connection, None if lease is None else now + lease)
        changed = self._store(values, now)
        cell.delivery.given(self._variables)
        assert requester.writer is not None
        cell.written(requester.writer, changed, now)
        return True

    def _is_usual(self, requester: Requester) -> bool:
        """Whether a trusted writer that owns everything asks in time, and the robot has all of it."""
        cell, writer = self._cell, requester.writer
        ownership, image = cell.ownership, cell.image
        if writer is None or requester.waited or not requester.trusted or not cell.delivery.ready:
            return False
        if ownership.orphans:
            return False
        changes = ownership.changes, image.changes_of_availability
        if writer != self._owner or changes != self._changes:
            if any(ownership.owners[lock] != writer for lock in self._locks):
                return False
            if not all(image.available[index] for index in self._variables):
                return False
            self._owner, self._changes = writer, changes
        return True

    def _store(self, values: list[Value], now: float) -> list[tuple[int, Value, Value]]:
        """Bring the image up to date; returns variable, old and new value of what changed, if anybody listens."""
        image, given_at = self._cell.image, self._cell.delivery.given_at
        listened = bool(self._cell.write_listeners)
        changed: list[tuple[int, Value, Value]] = []
        for span, part, good in self._spans:
            new = values[part]
            if listened:
                old = image.values[span]
                if old != new:
                    variables = self._variables[part]
                    changed += [
                        entry for entry in zip(variables, old, new, strict=True) if entry[1] != entry[2]
                    ]
            image.values[span] = new
            image.times[span] = given_at[span] = [now] * len(good)
            image.quality[span] = good
        return changed

    def _leased(self, locks: Sequence[int]) -> Iterator[tuple[slice, float | None]]:
        """Neighbouring locks with one lease."""
        declared = self._cell.ownership.locks
        for lease, group in groupby(locks, key=lambda lock: declared[lock].lease):
            for _first, span in _neighbours(list(group)):
                yield span, lease


def _bounds(cell: Cell, index: int, variable: Variable) -> tuple[float, float]:
    """Between which values of its kind a variable is written as it is, and is good then."""
    low, high = cell.image.bounds(index)
    if variable.kind is ValueKind.INT and variable.low is not None and variable.high is not None:
        low, high = max(low, variable.low), min(high, variable.high)
    if variable.limits is not None:
        low, high = max(low, variable.limits.low), min(high, variable.limits.high)
    return low, high


def _neighbours(numbers: Sequence[int]) -> Iterator[tuple[int, slice]]:
    """Runs of numbers that follow each other: where in `numbers` each begins, and what it covers."""
    for _key, group in groupby(enumerate(numbers), key=lambda entry: entry[1] - entry[0]):
        run = list(group)
        yield run[0][0], slice(run[0][1], run[-1][1] + 1)
