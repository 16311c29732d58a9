"""Programs by number and by path."""

from __future__ import annotations

from gatewayd.links.robot.dashboard.plan import DashboardPlan

PLAN = DashboardPlan("127.0.0.1", 29999, 0.5, ((1, "pick.urp"), (2, "cell3/pick.urp"), (7, "/place.urp")))


def test_a_number_is_a_file() -> None:
    assert PLAN.file_of(2) == "cell3/pick.urp"
    assert PLAN.file_of(3) is None
    assert PLAN.file_of(0) is None


def test_a_path_is_the_number_of_the_file_that_it_ends_with() -> None:
    assert PLAN.number_of("/programs/pick.urp") == 1
    assert PLAN.number_of("/programs/cell3/pick.urp") == 2
    assert PLAN.number_of("/programs/place.urp") == 7
    assert PLAN.number_of("pick.urp") == 1
    assert PLAN.number_of("/programs/nitpick.urp") == 0
    assert PLAN.number_of("") == 0
