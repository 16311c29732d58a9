"""What a cell refuses, and what nothing in it serves: counted, kept for the status block, and reported as events."""

from __future__ import annotations

from collections.abc import Callable

from gatewayd.core.definition import Value
from gatewayd.core.events import Event, EventKind, translated
from gatewayd.core.health import Health
from gatewayd.core.image import ProcessImage
from gatewayd.core.match import Match
from gatewayd.core.refusal import Refusal
from gatewayd.core.refusal_log import LastRefusal, RefusalLog
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved


class Refused:
    """The refused requests of one cell; equal ones are reported once in a while (`RefusalLog`)."""

    def __init__(self, image: ProcessImage, health: Health, report: Callable[[Event], None]) -> None:
        self.last: LastRefusal | None = None
        self.last_unserved: Event | None = None
        """The last request that nothing here serves, reported or only counted."""
        self._image = image
        self._health = health
        self._refusals = RefusalLog(report)
        self._unserved = RefusalLog(report)

    def refuse(self, requester: Requester, refusal: Refusal, now: float, value: Value | None) -> None:
        """Count and record a refusal; `value` is what was to be written."""
        self._health.writes_refused += 1
        peer = requester.peer if requester.writer is None else ""
        self.last = LastRefusal(refusal, requester.writer, now, peer)
        index = refusal.variable
        self._refusals.add(
            Event(
                now,
                EventKind.REFUSED,
                variable=index,
                lock=self._image.variables[index].lock if index is not None else None,
                writer=requester.writer,
                other=refusal.holder,
                reason=refusal.reason,
                old=self._image.values[index] if index is not None else None,
                new=value,
                detail=refusal.hint,
                peer=peer,
                request=refusal.request,
            )
        )

    def unserved(self, requester: Requester, reason: Unserved, request: str, now: float) -> None:
        """Count and record a request that nothing here serves; those of one peer and reason are reported together."""
        self._health.unserved[reason] += 1
        peer = requester.peer if requester.writer is None else ""
        event = Event(
            now, EventKind.UNSERVED, writer=requester.writer, reason=reason, peer=peer, request=request
        )
        self.last_unserved = event
        self._unserved.add(event)

    def tick(self, now: float) -> None:
        """Report what was only counted in an interval that has ended."""
        self._refusals.tick(now)
        self._unserved.tick(now)

    def succeed(self, former: Refused, match: Match, health: Health) -> None:
        """Go on counting what `former` counts, in `health`."""
        self._health = health
        last, unserved = former.last, former.last_unserved
        self.last = last.translated(match) if last is not None else None
        self.last_unserved = translated(unserved, match) if unserved is not None else None
        self._refusals.succeed(former._refusals, match)
        self._unserved.succeed(former._unserved, match)
