"""Who is next, without a line. What comes of it over time is in test_line.py."""

from __future__ import annotations

from gatewayd.modbus.client.requests import TimedOut, write_coil
from gatewayd.modbus.client.station import Job, Station
from gatewayd.modbus.client.turns import MAX_WRITES_IN_ROW, Turns
from gatewayd.modbus.client.unit import StationSettings
from tests.modbus.client.world import Heard, polls

VALUES = bytes(4)
SILENCE = TimedOut(0.3)


def made(count: int, period: float = 0.0) -> tuple[Turns, list[Station]]:
    """Turns of stations that all answer."""
    turns = Turns(0.05)
    stations = [Station(StationSettings(number, polls(period)), Heard()) for number in range(count)]
    for station in stations:
        turns.add(station)
        turns.finish(taken(turns), VALUES, 0.0)
    return turns, stations


def taken(turns: Turns, now: float = 0.0) -> Job:
    job = turns.next(now)
    assert job is not None
    return job


def next_probe(turns: Turns, now: float) -> Job | None:
    """The next probe at that time, if any; what is polled before is answered."""
    while (job := turns.next(now)) is not None and not job.is_probe:
        turns.finish(job, VALUES, now)
    return job


def test_who_has_waited_longest_is_next() -> None:
    turns, stations = made(3)
    order = []
    for _ in range(6):
        job = taken(turns)
        order.append(job.station)
        turns.finish(job, VALUES, 0.0)
    assert order == stations * 2


def test_writes_go_first_but_not_for_ever() -> None:
    turns, stations = made(2)
    for number in range(10):
        stations[0].write(number, write_coil(number, True), 0.0)
    kinds = []
    for _ in range(6):
        job = taken(turns)
        kinds.append(job.request.is_write)
        turns.finish(job, b"" if job.request.is_write else VALUES, 0.0)
    assert kinds == [True] * MAX_WRITES_IN_ROW + [False] + [True] * MAX_WRITES_IN_ROW + [False]


def test_lost_units_are_probed_one_after_the_other_and_paid_for() -> None:
    turns, stations = made(3, period=10.0)
    for station in stations[1:]:
        station.close("it was lost", 20.0)
    probe = next_probe(turns, 21.0)
    assert probe is not None
    assert next_probe(turns, 21.0) is None, "the other probe waits"
    turns.finish(probe, SILENCE, 21.3)
    assert next_probe(turns, 26.9) is None
    other = next_probe(turns, 27.1)
    assert other is not None
    assert other.station is not probe.station


def test_unit_that_was_just_lost_is_probed_once_without_regard_to_the_budget() -> None:
    turns, stations = made(3, period=10.0)
    stations[1].close("it was lost", 0.0)
    probe = next_probe(turns, 5.0)
    assert probe is not None
    turns.finish(probe, SILENCE, 5.3)
    stations[2].close("it was lost", 5.0)
    turns.may_be_back(stations[2])
    job = next_probe(turns, 6.4)
    assert job is not None
    assert job.station is stations[2]
    turns.finish(job, SILENCE, 6.7)
    assert next_probe(turns, 9.0) is None


def test_everybody_who_answers_has_a_turn_between_two_probes_in_vain() -> None:
    turns, stations = made(5)
    for station in stations[3:]:
        station.close("it was lost", 0.0)
        turns.may_be_back(station)
    order = []
    for _ in range(9):
        job = taken(turns, 5.0)
        order.append("probe" if job.is_probe else str(job.unit))
        turns.finish(job, SILENCE if job.is_probe else VALUES, 5.0)
    first = order.index("probe")
    second = order.index("probe", first + 1)
    assert set(order[first + 1 : second]) == {"0", "1", "2"}


def test_nobody_is_protected_where_nobody_answers() -> None:
    turns, stations = made(2)
    for station in stations:
        station.close("it was lost", 0.0)
    assert not turns.is_anybody_there
    for _ in range(2):
        turns.finish(taken(turns, 5.0), SILENCE, 5.0)
    assert turns.next(5.0) is None
    assert taken(turns, 6.0).is_probe


def test_job_of_a_unit_that_has_gone_blocks_no_probe() -> None:
    turns, stations = made(3)
    for station in stations[1:]:
        station.close("it was lost", 0.0)
    job = taken(turns, 5.0)
    while not job.is_probe:
        turns.finish(job, VALUES, 5.0)
        job = taken(turns, 5.0)
    assert job.station is not None
    turns.remove(job.station)
    turns.forget(job)
    following = [taken(turns, 5.0) for _ in range(2)]
    assert any(job.is_probe for job in following)
