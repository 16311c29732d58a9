"""Simulated lines between a controller and a cell: no age of a good value understates, and no good line is late.

A line is a list of packages: when the controller sent each by our clock, its timestamp, and when it came. What a line
needs from the first package on cannot be seen, and drift within `DRIFT` cannot be told from lag: both are allowed for.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Fallback, FallbackKind, ValueKind, Variable
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.lag import DRIFT

RATE = 125
STALE_AFTER = 0.1
TICK = 0.02
BYTES = 1100
"""What a package with all registers takes on the line."""
HOLD = Fallback(FallbackKind.HOLD)
LEVEL = Variable(1, "level", Direction.OUTPUT, ValueKind.FLOAT, "output_double_register_0", on_stale=HOLD)
DEFINITION = CellDefinition("press", 0, (LEVEL,), (), (), STALE_AFTER)


@dataclass(frozen=True)
class Package:
    """One package of the line."""

    sent: float
    came: float
    timestamp: float


Transit = Callable[[float, float], float]
"""When something comes that was sent at a time, after what was sent before it came."""


def line(
    seconds: float, transit: Transit, clock: Callable[[float], float] = lambda t: t + 7000
) -> list[Package]:
    """Packages of `seconds`; none overtakes another."""
    packages, before = [], 0.0
    for number in range(round(seconds * RATE)):
        sent = 50.0 + number / RATE
        before = max(before, transit(sent, before))
        packages.append(Package(sent, before, clock(sent)))
    return packages


def slow(rate: float) -> Transit:
    return lambda sent, before: max(sent, before) + BYTES / rate


def steps(seconds: float) -> Transit:
    """50 ms more every `seconds`, up to 3 s."""
    return lambda sent, _before: sent + 0.001 + min(3.0, 0.05 * ((sent - 50.0) // seconds))


def quick(jitter: float, seed: int = 0) -> Transit:
    """A line on which nothing takes longer than `jitter` and 1 ms."""
    chance = random.Random(seed)
    return lambda sent, _before: sent + 0.001 + jitter * chance.random() ** 4


def moments(packages: list[Package]) -> Iterator[tuple[float, Package | None]]:
    """Packages and ticks in the order of time."""
    ticks = 0.0
    for package in packages:
        ticks = max(ticks, package.came - 1.0)
        while ticks < package.came:
            yield ticks, None
            ticks += TICK
        yield package.came, package


def followed(cell: Cell, packages: list[Package], allowance: float) -> Iterator[Cell]:
    """Play the line to the cell. No good value may be older than its age says and `allowance`, and drift."""
    shown, start = -math.inf, packages[0].came
    for now, package in moments(packages):
        if package is None:
            cell.tick(now)
        elif cell.package_arrived(package.timestamp, now, raw=now):
            shown = package.sent
            cell.image.values[0] = package.sent
            cell.outputs_written(now)
        if cell.image.quality[0] is Quality.GOOD:
            true = now - shown
            assert cell.image.values[0] == shown
            assert cell.image.age(0, now) >= true - allowance - 2 * DRIFT * (now - start) - 1e-6
            assert true <= STALE_AFTER + TICK + allowance + 2 * DRIFT * (now - start) + 1e-6
        yield cell


def connected() -> Cell:
    cell = Cell(DEFINITION)
    cell.robot_connected(0.0)
    return cell


@pytest.mark.parametrize("rate", [60_000.0, 30_000.0, 1500.0])
def test_behind_a_slow_line_nothing_old_is_good(rate: float) -> None:
    packages = line(20.0, slow(rate))
    cell = connected()
    for _ in followed(cell, packages, BYTES / rate):
        pass
    assert cell.freshness.state is not Source.FRESH
    assert cell.health.lag > 1.0


@pytest.mark.parametrize("every", [0.1, 0.5, 2.0])
def test_a_delay_that_comes_in_small_steps_is_seen(every: float) -> None:
    cell = connected()
    for _ in followed(cell, line(60 * every + 2.0, steps(every)), 0.002):
        pass
    assert cell.freshness.state is Source.LATE
    assert cell.health.lag == pytest.approx(3.0, abs=0.1)


def test_a_reconnect_does_not_hide_a_delay() -> None:
    packages = line(40.0, steps(0.5))
    cell = connected()
    for number, _ in enumerate(followed(cell, packages, 0.002)):
        if number % 700 == 699:
            now = cell.freshness.last_package
            cell.robot_lost("reset", now)
            cell.robot_connected(now)
    assert cell.freshness.state is Source.LATE


def test_a_backlog_that_drains_is_fresh_again() -> None:
    cell = connected()

    def held_up(sent: float, before: float) -> float:
        return max(sent + 0.001, 57.0 if sent > 54.0 else 0.0, before + 0.001)

    seen: list[Source] = []
    for _ in followed(cell, line(20.0, held_up), 0.002):
        state = cell.freshness.state
        if not seen or seen[-1] is not state:
            seen.append(state)
    assert seen == [Source.WAITING, Source.FRESH, Source.SILENT, Source.LATE, Source.FRESH]
    assert [event.detail for event in cell.events if event.kind is EventKind.STALE] == ["silent"]


def test_a_clock_that_creeps_is_late() -> None:
    packages = line(3.0, quick(0.0))
    creeping = [replace(one, timestamp=7000 + number * 1e-9) for number, one in enumerate(packages)]
    cell = connected()
    for _ in followed(cell, creeping, STALE_AFTER):
        pass
    assert cell.freshness.state is Source.LATE
    assert not cell.lag_doubtful(packages[-1].came)


@settings(deadline=None, max_examples=25)
@given(
    jitter=st.floats(0.0, 0.9 * STALE_AFTER / 2),
    drift=st.floats(-400e-6, 400e-6),
    seed=st.integers(0, 1000),
    boot=st.booleans(),
)
def test_a_line_that_jitters_and_clocks_that_drift_are_never_late(
    jitter: float, drift: float, seed: int, boot: bool
) -> None:
    def clock(time: float) -> float:
        return (time - 55.0) * (1 + drift) if boot and time > 55.0 else 7000 + time * (1 + drift)

    cell = connected()
    for _ in followed(cell, line(10.0, quick(jitter, seed), clock), jitter + 0.002):
        assert cell.freshness.state in (Source.WAITING, Source.FRESH)


@settings(deadline=None, max_examples=25)
@given(
    changes=st.lists(
        st.tuples(st.sampled_from([1500.0, 20_000.0, 60_000.0, 1e9]), st.integers(1, 200)),
        min_size=1,
        max_size=8,
    ),
    drift=st.floats(-400e-6, 400e-6),
)
def test_whatever_the_line_does_no_age_understates(changes: list[tuple[float, int]], drift: float) -> None:
    """The speed of the line changes; the first package goes through quickly."""
    rates = [1e9, *(rate for rate, count in changes for _ in range(count))]
    number = iter(range(len(rates)))
    packages = line(
        len(rates) / RATE,
        lambda sent, before: max(sent, before) + BYTES / rates[next(number)],
        lambda time: 7000 + time * (1 + drift),
    )
    for _ in followed(connected(), packages, 0.002):
        pass


def test_a_day_of_drift_is_no_lag() -> None:
    """One package a second is enough to follow the drift."""
    for drift in (-400e-6, 400e-6):
        cell = Cell(replace(DEFINITION, stale_after=5.0))
        cell.robot_connected(0.0)
        for second in range(86400):
            assert cell.package_arrived(9000 + second * (1 + drift), float(second), raw=float(second))
            assert cell.health.lag < 0.002
