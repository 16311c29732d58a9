"""What passes the links, for traces: filtered, bounded, and raw. The reader makes words of it.

Taps are in the links only while there is a trace. Each trace keeps what was not read yet; what finds no room
is counted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Mapping, Sequence
from typing import Any, Protocol

from gatewayd.core.requester import host_of
from gatewayd.links.contract import Passage, Tap, TapOf
from gatewayd.report.verdict import ServedCell

MAX_TRACES = 4
"""Traces at one time."""
MAX_PASSAGES, MAX_BYTES = 10_000, 4_000_000
"""What a trace keeps unread; the oldest goes first."""

Row = dict[str, Any]
"""One passage as JSON; `{"dropped": n}`: so many were dropped since the trace began."""


class TracedGateway(Protocol):
    """What is needed of the daemon."""

    @property
    def runtimes(self) -> Sequence[ServedCell]:
        """The cells that are served now."""

    def trace(self, tap_of: TapOf | None) -> None:
        """Have what passes go through these taps."""


class Trace:
    """What passed links that `cell`, `link` (its name or kind) and `peer` (with or without port) choose; None: all."""

    def __init__(self, cell: str | None = None, link: str | None = None, peer: str | None = None) -> None:
        self.passed = 0
        self.dropped = 0
        self._cell, self._link, self._peer = cell, link, peer
        self._unread: deque[tuple[tuple[str, str, str], Passage]] = deque()
        self._bytes = 0

    def take(self, source: tuple[str, str, str], passage: Passage) -> None:
        """Keep it, if it is wanted. `source`: cell, name and kind of the link."""
        cell = source[0] if passage.cell == "" else passage.cell
        if self._cell is not None and cell not in (self._cell, None):
            return
        if self._link is not None and self._link not in (*source[1:], *passage.links):
            return
        if self._peer is not None and self._peer not in (passage.peer, host_of(passage.peer)):
            return
        self.passed += 1
        self._unread.append((source, passage))
        self._bytes += len(passage.data)
        while len(self._unread) > MAX_PASSAGES or self._bytes > MAX_BYTES:
            self._bytes -= len(self._unread.popleft()[1].data)
            self.dropped += 1

    def rows(self, most: int, ahead: float) -> Generator[None, None, list[Row]]:
        """What was not read yet, `most` at most; it pauses after each. The wall clock is `ahead` of the monotonic."""
        found: list[Row] = []
        while self._unread and len(found) < most:
            (cell, link, kind), passage = self._unread.popleft()
            self._bytes -= len(passage.data)
            found.append(
                {
                    "time": round(passage.time + ahead, 6),
                    "cell": cell if passage.cell == "" else passage.cell,
                    "link": passage.links[0] if len(passage.links) == 1 else link,
                    "kind": kind,
                    "peer": passage.peer,
                    "own": passage.own,
                    "out": passage.outgoing,
                    "data": passage.data.hex(),
                }
            )
            yield
        return found


class Traces:
    """All traces of one gateway."""

    def __init__(self, gateway: TracedGateway) -> None:
        self._gateway = gateway
        self._traces: list[Trace] = []
        self._taps: dict[tuple[str, str, str], Tap] = {}

    def open(self, query: Mapping[str, str]) -> Trace | None:
        """A trace of what `cell`, `link` and `peer` choose; None: there are too many already."""
        if len(self._traces) >= MAX_TRACES:
            return None
        trace = Trace(query.get("cell"), query.get("link"), query.get("peer"))
        self._traces.append(trace)
        self.refresh()
        return trace

    def close(self, trace: Trace) -> None:
        """The trace has ended; with the last one the taps are gone."""
        self._traces.remove(trace)
        if not self._traces:
            self._taps = {}
            self._gateway.trace(None)

    def refresh(self) -> None:
        """Have taps in links that are new."""
        if self._traces:
            self._gateway.trace(self._tap_of)

    def unknown(self, query: Mapping[str, str]) -> str:
        """What of the query no cell has, in words; empty if nothing."""
        served = self._gateway.runtimes
        cells = [runtime.cell.definition.name for runtime in served]
        if "cell" in query and query["cell"] not in cells:
            return f"there is no cell {query['cell']}, only {', '.join(cells)}"
        links = sorted(
            {
                text
                for runtime in served
                for name, plan in runtime.plan.links.items()
                for text in (name, plan.kind)
            }
        )
        if "link" in query and query["link"] not in links:
            return f"there is no link {query['link']}, only {', '.join(links)}"
        return ""

    def _tap_of(self, cell: str, link: str, kind: str) -> Tap:
        source = cell, link, kind
        if source not in self._taps:
            self._taps[source] = lambda passage: self._take(source, passage)
        return self._taps[source]

    def _take(self, source: tuple[str, str, str], passage: Passage) -> None:
        for trace in self._traces:
            trace.take(source, passage)
