"""Events with names, and the text of each: `hmi wrote limit = 999 N: refused, held by plc`.

Control interface, commands, status page and demonstration show this text; the log has fields instead
(`gatewayd.logs.events`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from gatewayd.core.definition import CellDefinition, Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.report.format import YOU, counted, exact, interval, value, verb
from gatewayd.report.printable import printable

ACCEPTED = "write accepted"
"""What happened when a write was accepted; the core has no event for it."""
DEVICE_WRITTEN = "device written"
"""What happened when the operator wrote to a device past the variables; the core has no event for it."""
REFUSED = EventKind.REFUSED.value
UNDECLARED, GATEWAY = "undeclared", "gateway"
"""Who did it where no writer did: a peer that no writer stands for, or gatewayd. No writer may have these names."""
UNDECLARED_PEER = "an undeclared peer"
"""How a text calls `UNDECLARED` where its address is not known."""
BAD = frozenset(
    kind.value
    for kind in (
        EventKind.ROBOT_LOST,
        EventKind.STALE,
        EventKind.UNAVAILABLE,
        EventKind.READ_BACK_DIFFERS,
        EventKind.ADOPTION_ENDS,
        EventKind.STOOD_STILL,
        EventKind.WRITER_LOST,
        EventKind.REFUSED,
        EventKind.UNSERVED,
        EventKind.FORCED,
        EventKind.COMMAND_REFUSED,
    )
)
"""What somebody should look at."""
_NOBODY = {EventKind.REFUSED: UNDECLARED, EventKind.UNSERVED: UNDECLARED, EventKind.FALLBACK: GATEWAY}
_UNSERVED = EventKind.UNSERVED.value
_TEXTS = {
    ACCEPTED: "{writer} wrote {variable}: {old} -> {new}",
    DEVICE_WRITTEN: "{writer} {request}",
    EventKind.FALLBACK.value: "{variable} fell back from {old} to {new}",
    EventKind.ACQUIRED.value: "{writer} took {lock}",
    EventKind.TAKEN_OVER.value: "{writer} took {lock} over from {holder}",
    EventKind.RELEASED.value: "{writer} no longer {hold} {lock}",
    EventKind.FORCED.value: "{writer} forced {variable} to {new}",
    EventKind.UNFORCED.value: "{variable} {are} no longer forced",
    EventKind.WRITER_CONNECTED.value: "{the_writer} connected",
    EventKind.WRITER_LOST.value: "{the_writer} {lost}",
    EventKind.UNAVAILABLE.value: "{variable} {are} unavailable",
    EventKind.AVAILABLE.value: "{variable} {are} available",
    EventKind.READ_BACK_DIFFERS.value: "read-back of {variable} differs",
    EventKind.FOLLOWED.value: "{variable} {follow} the robot: {old} -> {new}",
    EventKind.COMMANDED.value: "{writer} gave the command {variable}",
    EventKind.COMMAND_DONE.value: "the command {variable} was carried out",
    EventKind.COMMAND_REFUSED.value: "the command {variable} of {writer} was refused",
    EventKind.ADOPTION_ENDS.value: "{variable} {fall} back soon (adopted, but owned by nobody)",
}
"""Of those kinds that name and detail alone do not say."""
_WITHOUT_VALUES = {
    EventKind.FALLBACK.value: "{variable} fell back",
    EventKind.FOLLOWED.value: "{variable} {follow} the robot",
}
"""The same where the values are not known, or where it happened to several, each with a value of its own."""
_IN_PARENTHESES = frozenset(
    {
        ACCEPTED,
        DEVICE_WRITTEN,
        REFUSED,
        _UNSERVED,
        EventKind.ACQUIRED.value,
        EventKind.TAKEN_OVER.value,
        EventKind.FORCED.value,
    }
)
"""What has its detail in parentheses (by whom, how often); that of all others is the reason."""


@dataclass(frozen=True, slots=True)
class EventRecord:
    """An event, or an accepted write. Names, not indices: it outlives a reload. What does not apply is left out."""

    what: str
    """`write accepted`, or the text of the event's kind."""
    writer: str | None = None
    """Who did it, or to whom it happened: a writer, `operator`, `undeclared` or `gateway`."""
    variable: str | None = None
    unit: str = ""
    """Unit of the variable."""
    lock: str | None = None
    old: Value | None = None
    new: Value | None = None
    times: int = 1
    """Changes or refusals that it stands for."""
    holder: str | None = None
    """Who held the lock when it was refused, or before it was taken over."""
    reason: str | None = None
    """Why it was refused."""
    limits: str = ""
    """What would have been allowed, where the value was out of it: `0..150`."""
    peer: str | None = None
    """Address of a peer that no writer stands for."""
    detail: str = ""
    request: str = ""
    """What was asked for, where no variable tells it: `wrote holding 101`."""
    others: int = 0
    """Further variables or locks that it happened to in the same moment: `plc took start and 3 more`."""

    @classmethod
    def of(cls, event: Event, definition: CellDefinition) -> EventRecord:
        """The event of a cell of this definition."""
        variable = None if event.variable is None else definition.variables[event.variable]

        def name(writer: int | None) -> str | None:
            return None if writer is None else definition.writer_name(writer)

        return cls(
            event.kind.value,
            name(event.writer) or _NOBODY.get(event.kind),
            None if variable is None else variable.name,
            "" if variable is None else variable.unit,
            None if event.lock is None else definition.locks[event.lock].name,
            event.old,
            event.new,
            1 + event.repeats,
            name(event.other),
            None if event.reason is None else event.reason.text,
            _limits(event, definition),
            event.peer or None,
            event.detail,
            event.request,
        )

    def of_several(self, others: int) -> EventRecord:
        """The same for so many more variables or locks, whose values are left out."""
        return replace(self, others=others, old=None, new=None) if others else self

    @property
    def bad(self) -> bool:
        """Whether somebody should look at it."""
        return self.what in BAD

    def text(self, refused: str = "refused") -> str:
        """Who did what, with value and unit, why, who stood in the way and how often. `refused` may say how.

        An event whose variable, lock or writer a reload has removed goes by its kind; the detail has the names.
        What came from outside is escaped, as everything that people read.
        """
        return printable(self._text(refused))

    def _text(self, refused: str) -> str:
        if self.what == REFUSED:
            text = self._refusal(refused)
        elif self.what == _UNSERVED:
            text = f"{self._who()} {self.request}"
        else:
            text = self._usual()
        if self.what not in _IN_PARENTHESES:
            return f"{text}: {self.detail}" if self.detail else text
        often = counted(self.times, "change" if self.what == ACCEPTED else "time") if self.times > 1 else ""
        inside = ", ".join(filter(None, (often, self.detail)))
        return f"{text} ({inside})" if inside else text

    def _refusal(self, refused: str) -> str:
        # Beside its limits a value has every digit: rounded it would look as if it were within them.
        new = exact(self.new) if self.limits and isinstance(self.new, float) else self.new
        wrote = "" if new is None else f" = {value(new, self.unit)}"
        why = f"held by {self.holder}" if self.holder else self.reason
        answer = ", ".join(filter(None, (refused, why, self.limits)))
        request = self.request or f"wrote {self.variable or 'an address'}"
        return f"{self._who()} {request}{wrote}: {answer}"

    def _who(self) -> str | None:
        return _undeclared_peer(self.peer) if self.writer == UNDECLARED else self.writer

    def _usual(self) -> str:
        others = f" and {self.others} more" if self.others else ""
        known = {
            "are": verb("be", count=1 + self.others),
            "fall": verb("fall", count=1 + self.others),
            "follow": verb("follow", count=1 + self.others),
            "hold": verb("hold", self.writer or ""),
            "the_writer": self.writer and (YOU if self.writer == YOU else f"writer {self.writer}"),
            "lost": "left" if self.writer == YOU else "lost",
            "writer": self.writer,
            "variable": self.variable and self.variable + others,
            "lock": self.lock and self.lock + others,
            "holder": self.holder,
            "request": self.request or None,
            "old": None if self.old is None else value(self.old),
            "new": None if self.new is None else value(self.new, self.unit),
        }
        names = {name: text for name, text in known.items() if text is not None}
        for texts in (_TEXTS | _WITHOUT_VALUES if others else _TEXTS, _WITHOUT_VALUES):
            try:
                return texts[self.what].format_map(names)
            except KeyError:
                continue
        return f"{self.what} {self.variable}" if self.variable else self.what


def _limits(event: Event, definition: CellDefinition) -> str:
    """The declared limits that a refused value was out of: a reader need not look for the mapping."""
    limits = None if event.variable is None else definition.variables[event.variable].limits
    if limits is None or event.reason is not Reason.OUT_OF_LIMITS:
        return ""
    return interval(limits.low, limits.high)


def _undeclared_peer(peer: str | None) -> str:
    """How a text calls a peer that no writer stands for: with the address to declare, if it is known."""
    return f"undeclared peer {peer}" if peer else UNDECLARED_PEER
