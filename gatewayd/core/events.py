"""What happened, kept in a ring and passed to listeners."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum

from gatewayd.core.definition import Value
from gatewayd.core.history import History
from gatewayd.core.match import Match, at
from gatewayd.core.refusal import Reason
from gatewayd.core.unserved import Unserved

CAPACITY = 1000
"""Last events kept, whatever their kinds; of each kind older ones are kept beside them (`core.history`)."""


class EventKind(Enum):
    """The value is the text shown in logs."""

    ROBOT_CONNECTED = "robot connected"
    ROBOT_LOST = "robot lost"
    INPUTS_ADOPTED = "inputs adopted"
    STALE = "robot values stale"
    FRESH = "robot values fresh"
    UNAVAILABLE = "register unavailable"
    AVAILABLE = "register available"
    READ_BACK_DIFFERS = "read-back differs"
    WRITER_CONNECTED = "writer connected"
    WRITER_LOST = "writer lost"
    ACQUIRED = "lock acquired"
    TAKEN_OVER = "lock taken over"
    RELEASED = "lock released"
    FALLBACK = "fallback applied"
    REFUSED = "write refused"
    FORCED = "value forced"
    UNFORCED = "force ended"
    ADOPTION_ENDS = "adopted values fall back soon"
    FOLLOWED = "image follows the robot"
    STOOD_STILL = "gateway stood still"
    UNSERVED = "request not served"
    COMMANDED = "command sent"
    COMMAND_DONE = "command carried out"
    COMMAND_REFUSED = "command refused"


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened. Indices are those of the cell's definition; fields that do not apply are None."""

    time: float
    """Monotonic seconds."""
    kind: EventKind
    variable: int | None = None
    lock: int | None = None
    writer: int | None = None
    """Who did it, or to whom it happened."""
    other: int | None = None
    """The former owner of a lock taken over, or the holder in a refusal."""
    reason: Reason | Unserved | None = None
    old: Value | None = None
    new: Value | None = None
    repeats: int = 0
    """Refusals like this one that were counted but not reported since the last."""
    detail: str = ""
    peer: str = ""
    """Address of the peer in a refusal, where no writer was declared for it."""
    request: str = ""
    """What was asked for, in words of its link, where no variable tells it: `wrote holding 101`."""


class EventRing:
    """The last `capacity` events, and more of each kind, so that what is frequent does not drive out what is rare.

    Oldest first when iterated.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._history = History[Event](capacity)
        self.latest: dict[EventKind, Event] = {}
        """The last event of each kind."""
        self.listeners: list[Callable[[Event], None]] = []

    @property
    def count(self) -> int:
        """Events since the start, the forgotten ones included: the number of the last one."""
        return self._history.count

    def append(self, event: Event) -> None:
        """Keep the event and call the listeners."""
        self._history.append(event.kind, event.time, event)
        self.latest[event.kind] = event
        for listener in self.listeners:
            listener(event)

    def since(self, number: int, most: int | None = None) -> list[tuple[int, Event]]:
        """Events with greater numbers, `most` of them at most: the last ones, each with its number."""
        return self._history.since(number, most)

    def succeed(self, former: EventRing, match: Match) -> None:
        """Go on with the events of `former`; nobody hears them again."""
        self._history.succeed(former._history, lambda event: translated(event, match))
        self.latest = {kind: translated(event, match) for kind, event in former.latest.items()}

    def __iter__(self) -> Iterator[Event]:
        return iter(self._history)

    def __len__(self) -> int:
        return len(self._history)


def translated(event: Event, match: Match) -> Event:
    """The event with the new indices; of what is gone the name is kept in the detail."""
    former = event.variable, event.lock, event.writer, event.other
    indices = (
        at(match.variables, event.variable),
        at(match.locks, event.lock),
        at(match.writers, event.writer),
        at(match.writers, event.other),
    )
    if indices == former:
        return event
    variable, lock, writer, other = indices
    detail = ", ".join(filter(None, (event.detail, *_names_gone(event, match))))
    return replace(event, variable=variable, lock=lock, writer=writer, other=other, detail=detail)


def _names_gone(event: Event, match: Match) -> Iterator[str]:
    definition = match.old
    if event.variable is not None and event.variable not in match.variables:
        yield f"variable {definition.variables[event.variable].name}, since removed"
    elif event.variable is None and event.lock is not None and event.lock not in match.locks:
        yield f"lock {definition.locks[event.lock].name}, since removed"
    for role, writer in (("writer", event.writer), ("other", event.other)):
        if writer is not None and writer not in match.writers:
            yield f"{role} {definition.writers[writer].name}, since removed"
