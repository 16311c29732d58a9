"""What the robot got in a soak run, and whether it should have: pure, so that it can be tested without running an hour.

The robot's inputs may hold what a writer wrote lately, what the mapping declares for the time without an owner, and
what the operator forced; and what was acknowledged was there.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from tests.e2e.witness import Change
from tests.soak.journal import SENT, Entry

FALLBACK = 0
"""What every input of the cell declares for `on_release`."""
LATELY = 2.0
"""Seconds from when a writer was about to write until the robot has it: the longest limit of a writer, which is how
long a write may wait, and as much for a busy machine."""
_REACHED = 1.0
"""Seconds in which what was acknowledged is seen in the robot."""
_BREAKING = 0.1
"""Seconds before the answer that the robot is not connected in which its connection was breaking already: what was
acknowledged in them is not there after the next connect, as the image shows."""
NOT_CONNECTED = 11
"""Exception code 0B."""
_CYCLES = 0.03
"""Seconds in which a value may be overtaken by the next one without having been seen."""
_TAKEN = 0.2
"""Seconds from when a writer was about to write until the gateway has taken it, by a serial CAN adapter too."""
_RESUMED = 0.1
"""Seconds in which a process that was stopped goes on, on a busy machine."""
_AROUND = 0.2
"""Seconds before an acknowledgement in which the connection to the robot must have stood."""


@dataclass(frozen=True, slots=True)
class Period:
    """From when to when something could have been written that no journal has."""

    begin: float
    end: float
    fields: Sequence[str]
    value: float | None = None
    """None: any value."""


@dataclass(frozen=True, slots=True)
class Stop:
    """From when to when the gateway stood still."""

    begin: float
    end: float


@dataclass(slots=True)
class Record:
    """What faults did to the robot's inputs, and to those who write them."""

    periods: list[Period] = field(default_factory=list)
    pauses: list[Period] = field(default_factory=list)
    """In which a writer stood still: what it was about to write it wrote afterwards."""
    stops: list[Stop] = field(default_factory=list)


def misheld(name: str, changes: Sequence[Change], entries: Sequence[Entry], record: Record) -> Iterator[str]:
    """What the robot's field held and should not have."""
    sent: dict[float, list[float]] = {}
    for entry in entries:
        if entry.outcome == SENT:
            sent.setdefault(entry.value, []).append(entry.time)
    pauses = [pause for pause in record.pauses if name in pause.fields]
    stops = sorted(record.stops, key=lambda stop: stop.begin)
    for change in changes:
        if change.value == FALLBACK or _granted(name, change, record):
            continue
        moments = sent.get(change.value, [])
        place = bisect.bisect_right(moments, change.time)
        if not place:
            yield f"{name} held {change.value}, which nobody wrote"
            continue
        took = change.time - moments[place - 1]
        excused = sum(
            max(0.0, min(pause.end, change.time) - max(pause.begin, moments[place - 1])) for pause in pauses
        )
        excused += _stopped_in_the_act(moments[place - 1], stops)
        if any(_served_across(stop, change, moments) for stop in stops):
            continue
        if took - change.blind - excused > LATELY:
            yield f"{name} got {change.value} {took:.1f} s after it was written"


def _stopped_in_the_act(sent: float, stops: Sequence[Stop]) -> float:
    """Seconds for which the gateway was stopped while it served what had just been sent."""
    return sum(stop.end - stop.begin for stop in _begun(stops, sent - _CYCLES, sent + _TAKEN))


def _served_across(stop: Stop, change: Change, moments: Sequence[float]) -> bool:
    """Whether the value came when the gateway went on, and was being served when it was stopped."""
    came = change.time - change.blind
    if not stop.begin < change.time or came > stop.end + _RESUMED:
        return False
    first = bisect.bisect_left(moments, stop.begin - _TAKEN)
    return first < len(moments) and moments[first] <= stop.begin + _CYCLES


def _begun(stops: Sequence[Stop], since: float, until: float) -> Sequence[Stop]:
    """Those that began in this time, of stops in order."""
    first = bisect.bisect_left(stops, since, key=lambda stop: stop.begin)
    return stops[first : bisect.bisect_right(stops, until, key=lambda stop: stop.begin)]


def _granted(name: str, change: Change, record: Record) -> bool:
    return any(
        name in period.fields
        and period.value in {None, change.value}
        and period.begin <= change.time
        and change.time - change.blind <= period.end
        for period in record.periods
    )


def unheard(
    name: str,
    changes: Sequence[Change],
    entries: Sequence[Entry],
    watching: Callable[[float, float], bool],
    stops: Sequence[Stop] = (),
    *,
    lost: Sequence[float] = (),
    accepted: Sequence[float] = (),
) -> Iterator[str]:
    """What was acknowledged and never seen in the robot's field, though it was watched and nothing took its place.

    Where the gateway was stopped before the package left, its fallback may be seen instead, or what came at once when
    it went on: of two values that wait, the newer one is sent. `lost`: when somebody was answered that the robot is not
    connected, in order; what was acknowledged just before went into a broken connection. `accepted`: when writes to the
    field were acknowledged, anybody's, in order; the next one takes the place of one that has not been sent.
    """
    times = [change.time for change in changes]
    begun = 0.0
    for entry in entries:
        if entry.outcome == SENT:
            begun = entry.time
        elif entry.outcome == 0 and bisect.bisect_left(lost, entry.time) < bisect.bisect_right(
            lost, entry.time + _BREAKING
        ):
            continue
        elif entry.outcome == 0 and watching(entry.time - _AROUND, entry.time + _REACHED):
            first = bisect.bisect_left(times, begun)
            held = changes[first - 1].value if first else None
            stopped = _begun(stops, begun - _CYCLES, entry.time + _CYCLES)
            late = sum(stop.end - stop.begin for stop in stopped)
            last = bisect.bisect_right(times, entry.time + _REACHED + late)
            seen = changes[first:last]
            overtaken = any(change.time - change.blind < entry.time + _CYCLES for change in seen)
            overtaken |= bisect.bisect_right(accepted, entry.time) < bisect.bisect_left(
                accepted, entry.time + _CYCLES
            )
            overtaken |= any(_replaced(changes, times, stop) for stop in stopped)
            if (
                held != entry.value
                and not overtaken
                and all(follower.value != entry.value for follower in seen)
            ):
                yield f"{name} never held {entry.value}, acknowledged at {entry.time:.3f}"


def _replaced(changes: Sequence[Change], times: Sequence[float], stop: Stop) -> bool:
    """Whether the first value after the stop is the fallback of a lease that ended in it, or came at its very end."""
    place = bisect.bisect_right(times, stop.begin)
    if place == len(changes):
        return False
    change = changes[place]
    return change.value == FALLBACK or change.time - change.blind < stop.end + _RESUMED
