"""Values that wait: bounds, order, rate."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.sparkplug.declarations import MetricValue
from gatewayd.sparkplug.history import HistoryLimits, StoredValue, ValueHistory


def stored(value: int, since: float) -> StoredValue:
    return StoredValue("a", MetricValue(value, since), since)


def everything(history: ValueHistory, now: float = 0.0) -> list[tuple[str, object]]:
    """All that is sent when time is no object."""
    sent: list[tuple[str, object]] = []
    while history:
        device, batch = history.next_batch(now, lambda _device: True)
        sent += [(device, one.value.value) for one in batch]
        if batch:
            history.sent(device, batch, now)
        now += 0.001
    return sent


def test_the_oldest_is_dropped_and_counted() -> None:
    history = ValueHistory(HistoryLimits(size=3))
    for value in range(5):
        history.add("dev"[value % 3], stored(value, value / 10))
    assert len(history) == 3
    assert history.dropped == 2
    assert everything(history) == [("v", 2), ("d", 3), ("e", 4)]


def test_nothing_is_kept_where_nothing_is_to_be() -> None:
    history = ValueHistory(HistoryLimits(size=0))
    history.add("d", stored(1, 0.0))
    assert (len(history), history.dropped) == (0, 1)


def test_what_is_too_old_is_dropped_and_counted() -> None:
    history = ValueHistory(HistoryLimits(age=10.0))
    for since in (0.0, 5.0, 9.0):
        history.add("d", stored(1, since))
    history.expire(15.0)
    assert (len(history), history.dropped) == (2, 1)
    assert history.next_batch(100.0, lambda _device: True) == ("", [])
    assert (len(history), history.dropped) == (0, 3)


def test_a_message_has_values_of_one_device_in_their_order_and_the_rate_is_kept() -> None:
    history = ValueHistory(HistoryLimits(rate=10.0, batch=4))
    for value in range(6):
        history.add("d", stored(value, value))
    history.add("e", stored(9, 0.5))
    device, batch = history.next_batch(10.0, lambda _device: True)
    assert (device, [one.value.value for one in batch]) == ("d", [0, 1, 2, 3])
    history.sent(device, batch, 10.0)
    assert history.next_batch(10.39, lambda _device: True) == ("", [])
    assert history.next_batch(10.41, lambda _device: True)[0] == "e"


def test_what_was_not_sent_stays() -> None:
    history = ValueHistory(HistoryLimits())
    history.add("d", stored(1, 0.0))
    assert history.next_batch(1.0, lambda _device: True) == history.next_batch(1.0, lambda _device: True)


def test_a_dead_device_keeps_nobody_waiting() -> None:
    history = ValueHistory(HistoryLimits())
    history.add("dead", stored(1, 0.0))
    history.add("d", stored(2, 1.0))
    assert history.next_batch(2.0, lambda device: device == "d")[0] == "d"
    assert history.next_batch(2.0, lambda _device: False) == ("", [])


def test_metrics_that_are_no_more_are_dropped_and_counted() -> None:
    history = ValueHistory(HistoryLimits())
    for device in "dde":
        history.add(device, stored(1, 0.0))
    history.keep(lambda device, name: device == "e" and name == "a")
    assert (len(history), history.dropped) == (1, 2)


@given(st.lists(st.tuples(st.sampled_from("de"), st.booleans()), max_size=60), st.integers(0, 8))
def test_kept_sent_and_dropped_are_all_there_were(steps: list[tuple[str, bool]], size: int) -> None:
    history = ValueHistory(HistoryLimits(size=size, batch=3, age=20.0, rate=1e9))
    added = sent = 0
    for now, (device, is_sending) in enumerate(steps):
        if is_sending:
            one, batch = history.next_batch(float(now), lambda _device: True)
            history.sent(one, batch, float(now))
            sent += len(batch)
        else:
            history.add(device, stored(added, float(now)))
            added += 1
        assert len(history) <= size
        assert added == sent + history.dropped + len(history)
