from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.control.packages import MAX_FEEDS, MAX_READ, MAX_VALUES, PackageFeed, PackageFeeds, Row
from gatewayd.core.definition import Value
from gatewayd.links.contract import PackageLayout, PackageTap
from tests.control.served import FixedGateway, Served
from tests.works import finished


def layout(names: Sequence[str] = ("timestamp",), robot: str = "192.0.2.5:30004") -> PackageLayout:
    packing = struct.Struct(f">{len(names)}d")
    return PackageLayout(robot, tuple(names), ("DOUBLE",) * len(names), 0.002, lambda v: packing.pack(*v))


def rows(feed: PackageFeed, ahead: float = 100.0) -> list[Row]:
    found: list[Row] = finished(feed.rows(ahead))
    return found


def stamps(found: Sequence[Row]) -> list[float]:
    """The first value of every package."""
    return [
        struct.unpack_from(">d", bytes.fromhex(data))[0]
        for row in found
        for _time, data in row.get("packages", ())
    ]


def test_layout_packages_and_losses_come_in_their_order() -> None:
    feed = PackageFeed("press")
    feed.begin(layout())
    assert rows(feed) == [
        {
            "layout": {
                "cell": "press", "robot": "192.0.2.5:30004", "names": ["timestamp"], "types": ["DOUBLE"],
                "period": 0.002,
            }
        }
    ]  # fmt: skip
    feed.package((1.5,), 7.25)
    feed.lost("pulled")
    feed.begin(layout(("timestamp", "speed")))
    feed.package((2.5, 3.5), 8.0)
    first, lost, head, second = rows(feed)
    assert first == {"packages": [(107.25, struct.pack(">d", 1.5).hex())]}
    assert lost == {"lost": "pulled"}
    assert head["layout"]["names"] == ["timestamp", "speed"]
    assert second == {"packages": [(108.0, struct.pack(">2d", 2.5, 3.5).hex())]}
    assert rows(feed) == []


@given(st.lists(st.integers(1, 400), max_size=12))
def test_every_package_is_read_once_however_much_comes_between(counts: list[int]) -> None:
    feed, sent, read = PackageFeed("press"), 0, list[float]()
    feed.begin(layout())
    for count in counts:
        for _ in range(count):
            feed.package((float(sent),), 0.0)
            sent += 1
        read += stamps(rows(feed))
    assert read == list(range(sent))


def test_what_nobody_reads_is_dropped_and_counted() -> None:
    feed, wide = PackageFeed("press"), ("timestamp", *(f"v{number}" for number in range(999)))
    feed.begin(layout(wide))
    kept = MAX_VALUES // len(wide)
    for number in range(kept + 7):
        feed.package((float(number),) * len(wide), 0.0)
    assert feed.dropped == 7
    first = rows(feed)
    assert "layout" in first[0]
    assert stamps(first) == list(range(7, 7 + MAX_READ // len(wide))), "a reader takes a bounded part"
    found = first
    while more := rows(feed):
        found += more
    assert stamps(found) == list(range(7, kept + 7))
    feed.package((0.0,) * len(wide), 0.0)
    assert feed.dropped == 7, "there is room again"


def test_losses_alone_fill_nothing() -> None:
    feed = PackageFeed("press")
    for number in range(1000):
        feed.lost(f"attempt {number}")
    assert rows(feed) == [{"lost": "attempt 999"}]


@dataclass
class Tapped:
    """The source of a cell, as far as recordings need it."""

    tap: PackageTap | None = None
    calls: list[PackageTap | None] = field(default_factory=list)

    def tap_packages(self, tap: PackageTap | None) -> None:
        self.tap = tap
        self.calls.append(tap)


@pytest.fixture
def tapped(press: Served, monkeypatch: pytest.MonkeyPatch) -> Tapped:
    found = Tapped()
    monkeypatch.setattr(press.source, "tap_packages", found.tap_packages, raising=False)
    return found


def values(*found: float) -> tuple[Value, ...]:
    return found


def test_a_link_hands_on_packages_only_while_somebody_records(gateway: FixedGateway, tapped: Tapped) -> None:
    feeds = PackageFeeds(gateway)
    feeds.refresh()
    assert tapped.calls == [None]
    first = feeds.open("press")
    assert first is not None
    assert tapped.tap is not None
    tapped.tap.begin(layout())
    tapped.tap.package(values(1.0), 0.0)
    second = feeds.open("press")
    assert second is not None
    tapped.tap.package(values(2.0), 0.0)
    assert (stamps(rows(first)), stamps(rows(second))) == ([1.0, 2.0], [2.0])
    tapped.tap.lost("pulled")
    third = feeds.open("press")
    assert third is not None
    assert rows(third) == [], "there is no session"
    for feed in (first, second, third):
        assert tapped.calls[-1] is not None
        feeds.close(feed)
    assert tapped.calls[-1] is None


def test_there_are_few_at_a_time(gateway: FixedGateway) -> None:
    feeds = PackageFeeds(gateway)
    found = [feeds.open("press") for _ in range(MAX_FEEDS)]
    assert None not in found
    assert feeds.open("press") is None


def test_the_cell_is_named_where_there_are_several(gateway: FixedGateway, press: Served) -> None:
    feeds = PackageFeeds(gateway)
    assert feeds.named(None) == feeds.named("press") == "press"
    with pytest.raises(ValueError, match="there is no cell other, only press"):
        feeds.named("other")
    gateway.runtimes = [press, press]
    with pytest.raises(ValueError, match="say which with `cell`"):
        feeds.named(None)
