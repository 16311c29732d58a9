"""Where growth stops being linear is found by the slopes between the points."""

from __future__ import annotations

import pytest

from gatewayd.mapping.loader import load
from tests.benchmarks.growth import knee
from tests.benchmarks.growth_robots import host
from tests.benchmarks.growth_size import VARIABLES
from tests.benchmarks.image import doubles, one_of_many


def test_the_same_slope_is_linear() -> None:
    assert knee([(1, 3.0), (10, 12.0), (50, 52.0)]) == "linear up to 50"


def test_a_flatter_slope_is_no_knee() -> None:
    assert knee([(1, 3.0), (10, 12.0), (50, 32.0)]) == "linear up to 50"


def test_a_slope_within_a_fifth_is_linear() -> None:
    assert knee([(1, 1.0), (2, 2.0), (3, 3.19)]) == "linear up to 3"


def test_the_knee_is_where_the_slope_rises() -> None:
    assert knee([(1, 1.0), (10, 10.0), (50, 130.0)]) == "linear up to 10, then 3 x as much for each more"


@pytest.mark.parametrize("count", VARIABLES)
def test_a_mapping_has_as_many_variables_as_asked(count: int) -> None:
    loaded = load(doubles(count, 30004, 1502, 125).encode(), "doubles.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    assert len(loaded.plan.cell.variables) == count


def test_cells_have_robots_names_and_units_of_their_own() -> None:
    plans = [
        load(one_of_many(one, host(one), 30004, 1502, 125).encode(), "cell.yaml").plan for one in range(2)
    ]
    assert [plan.cell.name for plan in plans if plan is not None] == ["benchmark-0", "benchmark-1"]
    assert host(0) != host(1)
