"""Every package of a cell's robot, for recordings: bounded, and so that the fieldbus never notices a slow reader.

A link hands on its packages only while somebody records. What was not read yet is kept in memory up to a limit; the
oldest goes first and is counted. Nothing is encoded before it is read, and then in the share that answers have of
the gateway's time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from gatewayd.core.definition import Value
from gatewayd.links.contract import PackageLayout, PackageTap
from gatewayd.report.verdict import ServedCell

MAX_FEEDS = 4
"""Recordings of one gateway at one time."""
MAX_VALUES = 250_000
"""Values that a feed keeps unread: 8 s of 60 values at 500 Hz."""
MAX_READ = 50_000
"""Values that are read at one time."""
_IN_ROW = 20

Row = Mapping[str, Any]
"""One line of the answer, as docs/reference/control-api.md has it."""


class ServedCells(Protocol):
    """What is needed of the daemon."""

    @property
    def runtimes(self) -> Sequence[ServedCell]:
        """The cells that are served now."""


class _Kept(NamedTuple):
    layout: PackageLayout
    values: Sequence[Value]
    time: float


class PackageFeed(PackageTap):
    """What one reader has not read yet: packages, and losses of the robot in between."""

    def __init__(self, cell: str) -> None:
        self.cell = cell
        """Whose robot."""
        self.dropped = 0
        """Packages that were not read in time."""
        self._unread: deque[_Kept | str] = deque()
        self._values = 0
        self._layout: PackageLayout | None = None
        self._reported: PackageLayout | None = None

    def begin(self, layout: PackageLayout) -> None:
        """See `PackageTap`."""
        self._layout = layout

    def package(self, values: Sequence[Value], time: float) -> None:
        """See `PackageTap`."""
        if self._layout is None:
            return
        self._unread.append(_Kept(self._layout, values, time))
        self._values += len(values)
        while self._values > MAX_VALUES:
            oldest = self._unread.popleft()
            if isinstance(oldest, _Kept):
                self._values -= len(oldest.values)
                self.dropped += 1

    def lost(self, reason: str) -> None:
        """See `PackageTap`."""
        if self._unread and isinstance(self._unread[-1], str):
            self._unread.pop()
        self._unread.append(reason)

    def rows(self, ahead: float) -> Generator[None, None, list[Row]]:
        """The next of what was not read yet; it pauses after each package. The wall clock is `ahead` of ours."""
        found: list[Row] = []
        packages: list[tuple[float, str]] = []
        if self._reported is None and self._layout is not None and not self._unread:
            found.append(self._head(self._layout))
        left = MAX_READ
        while self._unread and left > 0:
            kept = self._unread.popleft()
            if isinstance(kept, str):
                packages = []
                found.append({"lost": kept})
                continue
            left -= len(kept.values)
            self._values -= len(kept.values)
            if kept.layout is not self._reported:
                packages = []
                found.append(self._head(kept.layout))
            if not packages or len(packages) >= _IN_ROW:
                packages = []
                found.append({"packages": packages})
            packages.append((round(kept.time + ahead, 6), kept.layout.pack(kept.values).hex()))
            yield
        return found

    def _head(self, layout: PackageLayout) -> Row:
        self._reported = layout
        return {
            "layout": {
                "cell": self.cell,
                "robot": layout.robot,
                "names": list(layout.names),
                "types": list(layout.types),
                "period": layout.period,
            }
        }


class _CellTap(PackageTap):
    """Hands what one link has to every feed of its cell."""

    def __init__(self) -> None:
        self.feeds: list[PackageFeed] = []
        self._layout: PackageLayout | None = None

    def add(self, feed: PackageFeed) -> None:
        self.feeds.append(feed)
        if self._layout is not None:
            feed.begin(self._layout)

    def begin(self, layout: PackageLayout) -> None:
        self._layout = layout
        for feed in self.feeds:
            feed.begin(layout)

    def package(self, values: Sequence[Value], time: float) -> None:
        for feed in self.feeds:
            feed.package(values, time)

    def lost(self, reason: str) -> None:
        self._layout = None
        for feed in self.feeds:
            feed.lost(reason)


class PackageFeeds:
    """All feeds of the cells that `served` has."""

    def __init__(self, served: ServedCells) -> None:
        self._served = served
        self._taps: dict[str, _CellTap] = {}

    def named(self, cell: str | None) -> str:
        """The cell that is meant; ValueError says which there are."""
        names = [runtime.cell.definition.name for runtime in self._served.runtimes]
        if cell is None and len(names) == 1:
            return names[0]
        if cell is None:
            raise ValueError(f"there are several cells ({', '.join(names)}): say which with `cell`")
        if cell not in names:
            raise ValueError(f"there is no cell {cell}, only {', '.join(names)}")
        return cell

    def open(self, cell: str) -> PackageFeed | None:
        """A feed of the packages of this cell from now on; None: there are too many already."""
        if sum(len(tap.feeds) for tap in self._taps.values()) >= MAX_FEEDS:
            return None
        feed = PackageFeed(cell)
        self._taps.setdefault(cell, _CellTap()).add(feed)
        self.refresh()
        return feed

    def close(self, feed: PackageFeed) -> None:
        """The feed has ended; with the last one of a cell its link hands on nothing more."""
        tap = self._taps[feed.cell]
        tap.feeds.remove(feed)
        if not tap.feeds:
            del self._taps[feed.cell]
            self.refresh()

    def refresh(self) -> None:
        """Have the links that there are now hand on what is wanted."""
        for runtime in self._served.runtimes:
            runtime.source.tap_packages(self._taps.get(runtime.cell.definition.name))
