"""The log under a flood: what is the same is written some times, then once in a while with the number of the others.

Anybody who can make the gateway log (a peer without a token, a controller that talks, a plant that flaps) could
otherwise fill the disk or make the journal drop what matters.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Hashable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from gatewayd.core.requester import host_of
from gatewayd.loop import clock
from gatewayd.loop.quota import Quota

EACH = 20
"""Lines of one event about one thing that are written one by one; then one in each `PERIOD`."""
PERIOD = 10.0
"""Seconds."""
OF_ONE_TEXT = 300
"""Lines of one event, whatever it is about, that are written one by one; then one a second."""
_LOOK = 1.0
_VOLATILE = frozenset({"old", "new", "repeats", "detail", "text", "path", "bus_time"})
"""Fields in which lines about the same thing differ."""
_NUMBER = re.compile(r"\d+")


@dataclass(slots=True)
class _Merged:
    """Lines that were not written."""

    last: logging.LogRecord
    count: int = 1


class MergingHandler(logging.StreamHandler[Any]):
    """A handler that keeps to these quotas. Lines of level debug are written as they come: somebody asked for them."""

    def __init__(self, stream: Any) -> None:
        super().__init__(stream)
        self._each = Quota(EACH, PERIOD)
        self._of_one_text = Quota(OF_ONE_TEXT, 1.0)
        self._merged: dict[Hashable, _Merged] = {}
        self._timer: asyncio.TimerHandle | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Write the line or count it."""
        if record.levelno <= logging.DEBUG:
            super().emit(record)
            return
        now = clock.now()
        text = record.name, record.levelno, record.getMessage()
        subject = text, _subject(record)
        for waiting in (text, subject):
            merged = self._merged.get(waiting)
            if merged is not None:
                merged.last = record
                merged.count += 1
                return
        if not self._of_one_text.has(text, now):
            self._merge(text, record)
        elif not self._each.has(subject, now):
            self._merge(subject, record)
        else:
            self._write(text, subject, record, now)

    def flush_merged(self) -> None:
        """Write what was merged and may be written now."""
        now = clock.now()
        for waiting, merged in list(self._merged.items()):
            text, subject = (merged.last.name, merged.last.levelno, merged.last.getMessage()), waiting
            if self._of_one_text.has(text, now) and (waiting == text or self._each.has(subject, now)):
                del self._merged[waiting]
                self._write(text, subject, _with_count(merged), now)

    def close(self) -> None:
        """Write all that was merged."""
        merged, self._merged = self._merged, {}
        for lines in merged.values():
            super().emit(_with_count(lines))
        super().close()

    def _merge(self, waiting: Hashable, record: logging.LogRecord) -> None:
        self._merged[waiting] = _Merged(record)
        if self._timer is None:
            with suppress(RuntimeError):  # no loop runs in this thread: the next line will do
                self._timer = asyncio.get_running_loop().call_later(_LOOK, self._due)

    def _due(self) -> None:
        self._timer = None
        self.acquire()
        try:
            self.flush_merged()
            if self._merged:
                self._timer = asyncio.get_running_loop().call_later(_LOOK, self._due)
        finally:
            self.release()

    def _write(self, text: Hashable, subject: Hashable, record: logging.LogRecord, now: float) -> None:
        self._of_one_text.take(text, now)
        self._each.take(subject, now)
        super().emit(record)


def _subject(record: logging.LogRecord) -> Hashable:
    """What the line is about."""
    found: dict[str, object] = getattr(record, "fields", {})
    return tuple((name, _known(name, str(value))) for name, value in found.items() if name not in _VOLATILE)


def _known(name: str, value: str) -> str:
    """A value without what differs each time: the port of a connection, the counts and times that a reason names."""
    if name == "peer":
        return host_of(value)
    return _NUMBER.sub("#", value) if name == "reason" else value


def _with_count(merged: _Merged) -> logging.LogRecord:
    """The last of the lines, and how many it stands for."""
    if merged.count > 1:
        merged.last.fields = {**getattr(merged.last, "fields", {}), "merged": merged.count}
    return merged.last
