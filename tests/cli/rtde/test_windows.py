"""Windows against a model that looks at all packages at once, and the controller's time as it goes on."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.windows import Always, StartStop, StreamClock, WhileTrue, Windows
from gatewayd.rtde.recipe import Scalar

PACKAGES = st.lists(st.tuples(st.integers(0, 5), st.booleans()), max_size=60)


def recorded(
    packages: list[tuple[int, bool]], before: float, after: float, limit: int = 1000
) -> tuple[list[int], int]:
    """The numbers of the packages that are recorded, and how many were left out between them."""
    windows = Windows[int](before, after, limit)
    found, left_out, now = [], 0, 0
    for number, (pause, active) in enumerate(packages):
        now += pause
        taken = windows.take(number, float(now), active=active)
        left_out += windows.left_out if taken else 0
        found += taken
        assert windows.open is bool(taken)
    return found, left_out


@given(PACKAGES, st.integers(0, 12), st.integers(0, 12))
def test_packages_within_the_windows_are_recorded_once_and_in_order(
    packages: list[tuple[int, bool]], before: int, after: int
) -> None:
    times = [sum(pause for pause, _ in packages[: number + 1]) for number in range(len(packages))]
    active = [number for number, (_, holds) in enumerate(packages) if holds]
    expected = [
        number
        for number, time in enumerate(times)
        if any(times[at] - time <= before if at >= number else time - times[at] <= after for at in active)
    ]
    found, left_out = recorded(packages, before, after)
    assert found == expected
    assert left_out == (expected[-1] + 1 - len(expected) if expected else 0)


@given(st.integers(1, 5), st.integers(0, 9))
def test_the_time_before_is_bounded_by_a_number_of_packages(limit: int, idle: int) -> None:
    found, _ = recorded([*[(1, False)] * idle, (1, True)], math.inf, 0, limit)
    assert found == list(range(max(0, idle - limit), idle + 1))


def holds(values: Sequence[Scalar]) -> bool:
    return bool(values[0])


def starts(values: Sequence[Scalar]) -> bool:
    return values[0] == 1


def stops(values: Sequence[Scalar]) -> bool:
    return values[0] == 2


def test_while_may_end_with_the_first_time() -> None:
    trigger = WhileTrue(holds, once=True)
    assert [trigger.active((value,)) for value in (0, 1, 1, 0, 1)] == [False, True, True, False, False]
    assert trigger.over
    again = WhileTrue(holds)
    assert [again.active((value,)) for value in (0, 1, 0, 1)] == [False, True, False, True]
    assert not again.over


def test_start_and_stop_are_part_of_the_recording() -> None:
    trigger = StartStop(starts, stops)
    assert [trigger.active((value,)) for value in (2, 0, 1, 1, 0, 2, 1)] == [
        False, False, True, True, True, True, False,
    ]  # fmt: skip
    assert trigger.over
    assert [StartStop(None, None).active((0,)), Always().active((0,))] == [True, True]


@given(st.lists(st.floats(0, 1e6) | st.sampled_from([math.nan, math.inf]) | st.none()))
def test_the_time_never_goes_back(stamps: list[float | None]) -> None:
    clock = StreamClock(0.002)
    before = 0.0
    for stamp in stamps:
        assert before <= clock.tick(stamp) < math.inf
        before = clock.now


def test_a_restarted_controller_goes_on_by_a_period() -> None:
    clock = StreamClock(0.5)
    assert [clock.tick(stamp) for stamp in (100.0, 100.5, 102.0, 0.0, 1.0)] == [0.0, 0.5, 2.0, 2.5, 3.5]
