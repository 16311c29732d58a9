from __future__ import annotations

from itertools import pairwise

from gatewayd.core.history import OF_KIND, SPACED, SPACING, History

LAST = 10


def test_what_is_frequent_does_not_drive_out_what_is_rare() -> None:
    history = History[str](LAST)
    history.append("rare", 0.0, "robot lost")
    for number in range(10_000):
        history.append("frequent", float(number), "lease ended")
    assert history.since(0)[0] == (1, "robot lost")
    assert history.count == 10_001
    assert len(list(history)) == len(history) <= 1 + LAST + OF_KIND + SPACED


def test_what_is_frequent_is_remembered_for_as_many_minutes_as_are_kept() -> None:
    history = History[float](LAST)
    for second in range(int(2 * SPACED * SPACING)):
        history.append("frequent", float(second), float(second))
    kept = list(history)
    assert kept[-LAST - OF_KIND :] == [float(second) for second in range(12_000 - LAST - OF_KIND, 12_000)]
    assert kept[0] < 12_000 - SPACED * SPACING
    assert max(later - earlier for earlier, later in pairwise(kept)) <= SPACING


def test_entries_come_in_their_order_with_their_numbers() -> None:
    history = History[int](LAST)
    for number in range(1, 401):
        history.append(number % 3, float(number), number)
    for since in (0, 57, 390, 395, 400, 401):
        found = history.since(since)
        assert found == sorted(found)
        assert all(number == entry > since for number, entry in found)
        for most in (0, 3, LAST, 50, 1000):
            assert history.since(since, most) == found[max(0, len(found) - most) :]
    assert history.since(394) == [(number, number) for number in range(395, 401)]


def test_a_successor_has_all_of_it() -> None:
    former, history = History[int](LAST), History[int](LAST)
    for number in range(1, 401):
        former.append(number % 3, float(number), number)
    history.succeed(former, lambda entry: -entry)
    assert history.since(0) == [(number, -entry) for number, entry in former.since(0)]
    history.append(0, 401.0, 401)
    assert history.since(400) == [(401, 401)]
    assert len(former) == len(history)
