"""Who is alive is decided by counters and time alone."""

from __future__ import annotations

from gatewayd.service.liveness import Liveness, Progressed


def test_whoever_moves_is_alive() -> None:
    liveness = Liveness(5)
    assert not any(liveness.late({"core": now, "robot": now // 3}, now) for now in range(60))


def test_whoever_stands_still_longer_than_the_patience_is_named_alone() -> None:
    liveness = Liveness(5)
    found = {now: liveness.late({"core": now, "robot": min(now, 10)}, now) for now in range(20)}
    assert [now for now, late in found.items() if late] == [16, 17, 18, 19]
    assert found[16] == ("robot",)


def test_moving_again_is_being_alive_again() -> None:
    liveness = Liveness(5)
    for now in range(10):
        late = liveness.late({"core": 1}, now)
    assert late == ("core",)
    assert liveness.late({"core": 2}, 10) == ()


def test_a_counter_that_starts_anew_has_moved() -> None:
    liveness = Liveness(5)
    for now in range(10):
        assert liveness.late({"robot": 7 if now < 5 else 0}, now) == ()


def test_who_is_served_no_longer_is_forgotten_and_begins_anew() -> None:
    liveness = Liveness(5)
    for now in range(5):
        liveness.late({"cell": 1}, now)
    liveness.late({}, 5)
    assert liveness.late({"cell": 1}, 7) == ()


def test_a_look_that_comes_late_itself_accuses_nobody() -> None:
    """A process that was stopped for an hour finds all its parts where they were."""
    liveness = Liveness(5)
    liveness.late({"core": 1}, 0)
    assert liveness.late({"core": 1}, 3600) == ()
    assert liveness.late({"core": 1}, 3603) == ()
    assert liveness.late({"core": 1}, 3605) == ()
    assert liveness.late({"core": 1}, 3606) == ("core",)


def test_the_first_look_accuses_nobody() -> None:
    assert Liveness(5).late({"core": 0}, 1e9) == ()


def test_all_have_turned_once_the_slowest_has() -> None:
    turned = Progressed()
    counts = [
        {"core": 1, "robot": 0},
        {"core": 2, "robot": 1},
        {"core": 3, "robot": 1},
        {"core": 3, "robot": 2},
    ]
    assert [turned.all_of(one) for one in counts] == [False, True, False, True]


def test_turns_since_the_last_time_count_not_since_the_last_question() -> None:
    turned = Progressed()
    assert turned.all_of({"core": 1, "robot": 1})
    assert not turned.all_of({"core": 2, "robot": 1})
    assert turned.all_of({"core": 2, "robot": 2})


def test_a_part_that_is_new_has_turned_when_it_has_begun() -> None:
    turned = Progressed()
    assert turned.all_of({"core": 1})
    assert not turned.all_of({"core": 2, "CAN": 0})
    assert turned.all_of({"core": 2, "CAN": 1})
    assert turned.all_of({"core": 3})
