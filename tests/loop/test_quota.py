from __future__ import annotations

from gatewayd.loop.quota import MAX_SUBJECTS, Quota


def taken(quota: Quota, subject: object, times: list[float]) -> int:
    """How many of so many attempts pass."""
    passed = 0
    for now in times:
        if quota.has(subject, now):
            quota.take(subject, now)
            passed += 1
    return passed


def test_some_at_once_and_then_one_in_each_period() -> None:
    quota = Quota(5, 10.0)
    assert taken(quota, "a", [0.0] * 100) == 5
    assert taken(quota, "a", [1.0 + step / 10 for step in range(600)]) == 6
    assert taken(quota, "b", [60.0] * 100) == 5, "each has its own"
    assert taken(quota, "a", [1000.0] * 100) == 5, "after a quiet time all of it again"


def test_what_is_taken_beyond_it_is_no_debt_for_ever() -> None:
    quota = Quota(5, 10.0)
    for _ in range(1000):
        quota.take("a", 0.0)
    assert not quota.has("a", 9.0)
    assert quota.has("a", 20.0)


def test_many_names_are_no_way_around_it() -> None:
    quota = Quota(2, 10.0)
    assert sum(taken(quota, number, [0.0]) for number in range(10 * MAX_SUBJECTS)) <= MAX_SUBJECTS + 2
    assert taken(quota, "a", [1.0] * 5) == 0
    assert taken(quota, "a", [100.0] * 5) == 2
