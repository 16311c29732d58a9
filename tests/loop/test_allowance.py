from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.loop.allowance import Allowance


def test_a_burst_goes_at_once_and_the_rest_at_the_rate() -> None:
    allowance = Allowance(3, 10.0)
    assert [allowance.take(1.0) for _ in range(4)] == [True, True, True, False]
    assert allowance.due(1.0) == 1.1
    assert not allowance.take(1.05)
    assert allowance.take(1.1)
    assert not allowance.take(1.1)


def test_a_long_quiet_saves_no_more_than_the_burst() -> None:
    allowance = Allowance(2, 1.0)
    assert [allowance.take(100.0) for _ in range(3)] == [True, True, False]


@given(st.lists(st.floats(0, 5), max_size=50), st.integers(1, 5), st.floats(0.1, 20))
def test_one_that_is_due_is_allowed_and_no_earlier_one_is_too_many(
    pauses: list[float], burst: int, rate: float
) -> None:
    allowance, now, taken = Allowance(burst, rate), 0.0, 0
    for pause in pauses:
        now += pause
        taken += allowance.take(now)
        assert taken <= burst + now * rate + 1e-6
    now = allowance.due(now)
    assert allowance.take(now)
