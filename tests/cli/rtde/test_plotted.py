"""The values that are drawn, and where their curves are interrupted."""

from __future__ import annotations

import math

from gatewayd.cli.rtde.plotted import Row, plotted, time_label
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import program_runs


def recipe(*names: str) -> Recipe:
    return Recipe(names, [OUTPUTS[name].type for name in names])


def shown(values: object) -> list[float | None]:
    assert isinstance(values, list)
    return [None if math.isnan(value) else value for value in values]


RECIPE = recipe("timestamp", "runtime_state", "tcp_force_scalar")


def rows(*found: tuple[float, int, float]) -> list[Row]:
    return [(row, None) for row in found]


def test_time_counts_from_the_first_package() -> None:
    drawn = plotted(rows((1234.0, 1, 5.0), (1234.5, 1, 6.0)), RECIPE, [2])
    assert (drawn.time.tolist(), drawn.values[2].tolist(), drawn.packages) == ([0.0, 0.5], [5.0, 6.0], 2)


def test_a_gap_and_a_clock_that_went_back_interrupt_the_curve() -> None:
    found = rows((1.0, 1, 1.0), (2.0, 1, 2.0), (5.0, 1, 3.0), (0.5, 1, 4.0))
    drawn = plotted(found, RECIPE, [2], gaps={2})
    assert shown(drawn.values[2].tolist()) == [1.0, 2.0, None, 3.0, None, 4.0]
    assert drawn.time.tolist() == [0.0, 1.0, 1.0, 4.0, 4.0, -0.5]
    assert drawn.packages == 4


def test_only_while_the_program_runs() -> None:
    found = rows((0.0, 1, 0.0), (1.0, 2, 1.0), (2.0, 2, 2.0), (3.0, 4, 3.0), (4.0, 2, 4.0), (5.0, 1, 5.0))
    drawn = plotted(found, RECIPE, [2], runs=program_runs(RECIPE))
    assert shown(drawn.values[2].tolist()) == [1.0, 2.0, None, 4.0]
    assert (drawn.time.tolist(), drawn.packages) == ([0.0, 1.0, 1.0, 3.0], 3)


def test_without_a_timestamp_the_host_time_or_the_number_of_the_package_counts() -> None:
    force = recipe("tcp_force_scalar")
    timed = plotted([((1.0,), 50.0), ((2.0,), 50.25)], force, [0])
    assert timed.time.tolist() == [0.0, 0.25]
    assert plotted([((1.0,), None), ((2.0,), None)], force, [0]).time.tolist() == [0.0, 1.0]
    assert [time_label(force, host_time=host_time) for host_time in (False, True)] == ["package", "time in s"]
    assert time_label(RECIPE, host_time=False) == "time in s"
