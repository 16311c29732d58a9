"""From the packages that come to the file that a person gets: which are wanted, what is missing between them, when it
is enough. Has the files, but no robot and no clock.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Self

from gatewayd.cli.rtde.conditions import ConditionError
from gatewayd.cli.rtde.progress import Tally
from gatewayd.cli.rtde.windows import Always, StreamClock, Trigger, Windows, most_before
from gatewayd.report.format import counted, listed, span
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording.errors import RecordingError
from gatewayd.rtde.recording.gaps import GapWatch, GapWriter, RecordedGap
from gatewayd.rtde.recording.writing import create_recording
from gatewayd.rtde.session import TIMESTAMP

LEFT_OUT = "left out by the condition"
"""The reason of a gap that is no loss."""
_FLUSH_EVERY = 1 << 20
_PATIENCE = 1.0
"""Seconds by which the host's time may run past the wanted duration: the controller's stands still, or it is away."""

Values = tuple[Scalar, ...]


@dataclass(frozen=True, slots=True)
class SourceLayout:
    """What the packages of a source have."""

    recipe: Recipe
    period: float
    """Seconds between two packages."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingOrder:
    """What a person wants recorded."""

    path: str
    fields: tuple[str, ...] = ()
    """Columns; none: everything that comes."""
    binary: bool = False
    delimiter: str = " "
    host_time: bool = False
    overwrite: bool = False
    samples: int | None = None
    """Packages at most."""
    duration: float | None = None
    """Seconds at most, from the first package that is recorded for its own sake: what was before it comes on top."""
    trigger: Callable[[Recipe], Trigger] = lambda _recipe: Always()
    """Makes what says which packages are wanted; may raise ConditionError."""
    before: float = 0.0
    """Seconds that are recorded before the wanted packages, and after them."""
    after: float = 0.0


class Recorder:
    """Records the packages of one source. As a context manager it closes its files at the end."""

    def __init__(self, order: RecordingOrder, layout: SourceLayout) -> None:
        """Create the file. RecordingError, ConditionError."""
        recipe = layout.recipe
        columns = _columns(order.fields, recipe)
        most = _most_before(order.before, layout)
        self.over = False
        """Nothing more is wanted."""
        self.lost_packages = 0
        """Wanted packages that are missing, as far as it is known."""
        self._order = order
        self._pick = _picker(recipe, columns)
        self._trigger = order.trigger(recipe)
        # Half a period more: packages are a whole number of periods apart, and their times are rounded.
        spare = layout.period / 2
        self._windows: Windows[tuple[Values, float]] = Windows(
            order.before + spare, order.after + spare, most
        )
        self._clock = StreamClock(layout.period)
        slot = recipe.slots.get(TIMESTAMP)
        self._timestamp = slot.start if slot is not None else None
        self._watch = GapWatch(recipe, layout.period)
        self._found: list[RecordedGap] = []
        self._gap_count = 0
        self._left_out = 0
        self._packages = 0
        self._began: float | None = None
        self._began_at: float | None = None
        self._file = create_recording(
            order.path,
            Recipe(columns, [recipe.kinds[name] for name in columns]),
            binary=order.binary,
            delimiter=order.delimiter,
            host_time=order.host_time,
            overwrite=order.overwrite,
            flush_every=_FLUSH_EVERY,
        )
        self._gaps = GapWriter(order.path, overwrite=order.overwrite)

    def take(self, packages: Sequence[tuple[Values, float]], now: float) -> None:
        """Record what is wanted of packages that came together, each with its host time. `now`: monotonic seconds.

        RecordingError where the file cannot take more; it then ends with the last package that found room.
        """
        for values, host_time in packages:
            if self.over:
                break
            self._take(values, host_time, now)
        try:
            self._file.flush()
        finally:
            self._write_gaps()

    def lost(self, reason: str) -> None:
        """Packages are missing from here on, for this reason in words."""
        self._watch.lost(reason)

    def look(self, now: float) -> None:
        """Whether the time is over, whatever comes or does not."""
        duration = self._order.duration
        if duration is not None and self._began_at is not None:
            self.over = self.over or now - self._began_at > duration + _PATIENCE

    @property
    def waiting(self) -> bool:
        """Whether packages come and are not wanted."""
        return not self._windows.open

    def tally(self, rate: float = 0.0, waiting: str = "") -> Tally:
        """How far it is."""
        return Tally(
            seconds=self._clock.now - self._began if self._began is not None else 0.0,
            packages=self._packages,
            size=self._file.size,
            rate=rate,
            skipped=self.lost_packages,
            gaps=self._gap_count,
            left_out=self._left_out,
            waiting=waiting,
        )

    def close(self) -> None:
        """Write what is left, and close; RecordingError where the system reports only now that it could not."""
        try:
            self._file.close()
        finally:
            self._gaps.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()

    def _take(self, values: Values, host_time: float, now: float) -> None:
        time = self._clock.tick(float(values[self._timestamp]) if self._timestamp is not None else None)
        active = self._trigger.active(values)
        wanted = self._windows.take((values, host_time), time, active=active)
        left_out = self._windows.left_out
        for each in wanted:
            if self._began is None:
                self._began, self._began_at = time, now
            elif self._is_enough(time):
                return
            self._write(*each, left_out if self._packages else 0)
            left_out = 0
        self.over = self._is_enough(None) or (self._trigger.over and not self._windows.open)

    def _is_enough(self, time: float | None) -> bool:
        order = self._order
        self.over = order.samples is not None and self._packages >= order.samples
        if time is not None and order.duration is not None and self._began is not None:
            self.over = self.over or time - self._began >= order.duration - self._clock.period / 2
        return self.over

    def _write_gaps(self) -> None:
        """Those before packages that the file has; one that found no room is in no gap either."""
        found, self._found = self._found, []
        for gap in found:
            if gap.package < self._file.packages:
                self._gaps.write(gap)

    def _write(self, values: Values, host_time: float, left_out: int) -> None:
        self._left_out += left_out
        gap = self._watch.check(values, host_time if self._order.host_time else None)
        if gap is not None:
            if left_out:
                gap = replace(gap, reason=LEFT_OUT, missing=left_out)
            else:
                self._gap_count += 1
                self.lost_packages += gap.missing or 0
            self._found.append(gap)
        self._file.write(self._pick(values), host_time)
        self._packages += 1


def _most_before(before: float, layout: SourceLayout) -> int:
    """How many packages can be kept; ConditionError if the time before a condition has more."""
    most, wanted = most_before(layout.recipe.count), before / layout.period
    if wanted > most:
        raise ConditionError(
            f"--before: {span(before)} are {wanted:.0f} packages of {counted(layout.recipe.count, 'value')}, and "
            f"{most} can be kept, {span(most * layout.period)}; record fewer fields, or at a lower --frequency"
        )
    return most


def _columns(wanted: tuple[str, ...], recipe: Recipe) -> tuple[str, ...]:
    absent = [name for name in wanted if name not in recipe.kinds]
    if absent:
        raise RecordingError(
            f"not among the fields that come: {listed(absent, 5)}; there are {listed(recipe.names, 20)}"
        )
    return wanted or recipe.names


def _picker(recipe: Recipe, columns: tuple[str, ...]) -> Callable[[Values], Sequence[Scalar]]:
    """From the values of a package to those of the columns."""
    if columns == recipe.names:
        return lambda values: values
    places = [place for name in columns for place in range(recipe.count)[recipe.slots[name]]]
    if len(places) == 1:
        return lambda values: (values[places[0]],)
    return itemgetter(*places)
