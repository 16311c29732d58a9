"""The histogram against counting by hand."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.web.histogram import BOUNDS, Histogram


@given(st.lists(st.floats(-1, 3, allow_nan=False)))
def test_buckets_count_what_is_up_to_their_bound(durations: list[float]) -> None:
    histogram = Histogram()
    for one in durations:
        histogram.observe(one)
    clipped = [max(one, 0.0) for one in durations]
    assert dict(histogram.buckets()) == {
        bound: sum(one <= bound for one in clipped) for bound in (*BOUNDS, math.inf)
    }
    assert histogram.count == len(durations)
    assert histogram.total == pytest.approx(sum(clipped))


def test_the_aims_of_the_project_are_bounds() -> None:
    """0.3 ms from package to image and 0.5 ms from write to package can be read off without interpolation."""
    assert {0.0003, 0.0005} <= set(BOUNDS)
    assert list(BOUNDS) == sorted(BOUNDS)
