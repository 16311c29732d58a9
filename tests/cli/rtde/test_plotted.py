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


FORCE = "tcp_force_scalar"
RECIPE = recipe("timestamp", "runtime_state", FORCE)


def rows(*found: tuple[float, int, float]) -> list[Row]:
    return [(row, None) for row in found]


def test_time_counts_from_the_first_package() -> None:
    drawn = plotted(rows((1234.0, 1, 5.0), (1234.5, 1, 6.0)), RECIPE, [FORCE])
    assert (drawn.time.tolist(), drawn.values[FORCE].tolist(), drawn.packages) == ([0.0, 0.5], [5.0, 6.0], 2)


def test_a_gap_and_a_clock_that_went_back_interrupt_the_curve() -> None:
    found = rows((1.0, 1, 1.0), (2.0, 1, 2.0), (5.0, 1, 3.0), (0.5, 1, 4.0))
    drawn = plotted(found, RECIPE, [FORCE], gaps={2})
    assert shown(drawn.values[FORCE].tolist()) == [1.0, 2.0, None, 3.0, None, 4.0]
    assert drawn.time.tolist() == [0.0, 1.0, 1.0, 4.0, 4.0, -0.5]
    assert drawn.packages == 4


def test_only_while_the_program_runs() -> None:
    found = rows((0.0, 1, 0.0), (1.0, 2, 1.0), (2.0, 2, 2.0), (3.0, 4, 3.0), (4.0, 2, 4.0), (5.0, 1, 5.0))
    drawn = plotted(found, RECIPE, [FORCE], runs=program_runs(RECIPE))
    assert shown(drawn.values[FORCE].tolist()) == [1.0, 2.0, None, 4.0]
    assert (drawn.time.tolist(), drawn.packages) == ([0.0, 1.0, 1.0, 3.0], 3)


def test_without_a_timestamp_the_host_time_or_the_number_of_the_package_counts() -> None:
    force = recipe(FORCE)
    timed = plotted([((1.0,), 50.0), ((2.0,), 50.25)], force, [FORCE])
    assert timed.time.tolist() == [0.0, 0.25]
    assert plotted([((1.0,), None), ((2.0,), None)], force, [FORCE]).time.tolist() == [0.0, 1.0]
    assert [time_label(force, host_time=host_time) for host_time in (False, True)] == ["package", "time in s"]
    assert time_label(RECIPE, host_time=False) == "time in s"


def test_packages_between_two_interruptions_are_known() -> None:
    found = rows(*((float(number), 1, 1.0) for number in range(8)))
    drawn = plotted(found, RECIPE, [FORCE], gaps={1, 4, 5, 7})
    assert [drawn.time[place] for place in drawn.lone] == [0.0, 4.0, 7.0]
    assert plotted(found, RECIPE, [FORCE]).lone == []
    assert plotted(found[:1], RECIPE, [FORCE]).lone == [0]


def test_columns_that_a_recording_lacks_are_left_out() -> None:
    assert list(plotted(rows((0.0, 1, 1.0)), RECIPE, ["payload", FORCE]).values) == [FORCE]
