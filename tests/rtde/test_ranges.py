from __future__ import annotations

import pytest

from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.ranges import RANGES, usual_range
from gatewayd.rtde.types import INTEGER_RANGES


@pytest.mark.parametrize("field", RANGES)
def test_ranges_are_those_of_fields_that_exist(field: str) -> None:
    """One for all elements of a field, or one for each; none is more than the type holds."""
    known = INPUTS.get(field) or OUTPUTS[field]
    ranges = RANGES[field]
    assert len(ranges) in {1, known.type.count}
    low, high = INTEGER_RANGES.get(known.type.code, (-1e9, 1e9))
    assert all(low <= one[0] < one[1] <= high for one in ranges)


def test_elements_have_ranges_of_their_own() -> None:
    assert usual_range("actual_TCP_pose", 0) == (-0.5, 0.5)
    assert usual_range("actual_TCP_pose", 3) == (-3.1416, 3.1416)
    assert usual_range("actual_q", 5) == (-6.283, 6.283)
    assert usual_range("robot_mode") == (-1, 255)
    assert usual_range("output_double_register_0") is None
