from __future__ import annotations

import pytest

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.grouping import WantedItem, plan_classes
from gatewayd.modbus.client.requests import (
    BadAnswer,
    ConnectionLost,
    ExceptionAnswer,
    TimedOut,
    read,
    write_coil,
    write_register,
)
from gatewayd.modbus.client.station import MAX_ASKED, Station
from gatewayd.modbus.client.unit import StationSettings, UnitState
from gatewayd.modbus.client.writes import PartWrite
from tests.modbus.client.world import Unit, make_world, polls

ILLEGAL_ADDRESS = ExceptionAnswer(2)


def refuse(code: int = 2) -> object:
    return lambda pdu: bytes((pdu[0] | 0x80, code))


def silence(unit: Unit) -> None:
    unit.change = lambda _: None


def state_of(station: Station) -> UnitState:
    """What mypy takes for unchanged while time passes."""
    return station.state


def heal(unit: Unit) -> None:
    unit.change = lambda pdu: pdu


def test_values_come_with_their_period() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.02))})
    units[1].registers = {0: 0x1234, 1: 0x5678}
    world.run(1.0)
    assert heard[1].states == [(UnitState.ONLINE, "", 0.002)]
    assert {data for _, data in heard[1].values} == {b"\x12\x34\x56\x78"}
    assert len(heard[1].values) in range(50, 53)
    counters = stations[1].counters
    assert counters.answers == counters.requests == len(heard[1].values)
    trip = counters.round_trip
    assert (trip.last, trip.mean, trip.greatest) == pytest.approx((0.002,) * 3)


def test_poll_classes_have_periods_of_their_own() -> None:
    wanted = [WantedItem(Area.HOLDING, 0, 1), WantedItem(Area.COIL, 0, 3)]
    world, _, heard, _ = make_world({1: StationSettings(1, plan_classes(wanted, [0.1, 1.0]))})
    world.run(10.05)
    areas = [group.area for group, _ in heard[1].values]
    assert areas.count(Area.HOLDING) in range(101, 104)
    assert areas.count(Area.COIL) in range(11, 13)


def test_write_goes_out_at_once_before_the_next_poll() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, polls(1.0))})
    world.run(0.5)
    units[1].requests.clear()
    assert stations[1].write("a", write_register(5, b"\0\x07"), world.now)
    world.run(0.01)
    assert units[1].registers[5] == 7
    assert units[1].requests == [bytes.fromhex("0600050007")]
    assert heard[1].written == [("a", None)]
    assert stations[1].counters.writes == 1


def test_newest_write_wins_while_the_line_is_busy() -> None:
    world, stations, _, units = make_world({1: StationSettings(1, polls(1.0))})
    world.run(0.5)
    units[1].requests.clear()
    stations[1].write("b", write_coil(0, True), world.now)
    world.line.next_frame(world.now)  # the line is busy with it from now on
    for value in range(1, 5):
        stations[1].write("a", write_register(5, bytes((0, value))), world.now)
    world.run(0.5)
    assert [pdu.hex() for pdu in units[1].requests if pdu[0] == 6] == ["0600050004"]
    assert stations[1].counters.dropped_writes == 3


def test_write_is_repeated() -> None:
    world, stations, _, units = make_world({1: StationSettings(1, polls(1.0))})
    world.run(0.5)
    stations[1].write("a", write_register(5, b"\0\x07"), world.now, repeat=0.2)
    world.run(1.09)
    assert len([pdu for pdu in units[1].requests if pdu[0] == 6]) == 6
    stations[1].cancel("a")
    units[1].requests.clear()
    world.run(1.0)
    assert [pdu for pdu in units[1].requests if pdu[0] == 6] == []


@pytest.mark.parametrize("has_mask_write", [True, False])
def test_part_of_a_register_leaves_the_rest(has_mask_write: bool) -> None:
    settings = StationSettings(1, polls(1.0))
    world, stations, heard, units = make_world({1: settings})
    if not has_mask_write:
        units[1].functions.remove(22)
    units[1].registers[5] = 0x1234
    world.run(0.5)
    stations[1].write("a", PartWrite(5, 0x00F0, 0x0070), world.now)
    world.run(0.5)
    assert units[1].registers[5] == 0x1274
    assert heard[1].written == [("a", None)]


def test_silent_unit_is_lost_in_bounded_time_and_found_again() -> None:
    breaker = BreakerSettings(failures=3, lost_after=2.0, probe_every=1.0)
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.02), 0.1, breaker)})
    world.run(1.0)
    silence(units[1])
    world.run(1.0)
    state, reason, at = heard[1].states[-1]
    assert (state, reason) == (UnitState.LOST, "no answer within 0.1 s")
    assert at - 1.0 < 3 * 0.1 + 0.04
    assert (stations[1].state, stations[1].reason) == (state, reason)
    assert stations[1].counters.losses == 1
    world.run(5.0)
    heal(units[1])
    world.run(1.1)
    assert state_of(stations[1]) is UnitState.ONLINE
    assert stations[1].reason == ""


def test_unit_counts_as_lost_by_time_though_failures_are_few() -> None:
    breaker = BreakerSettings(failures=100, lost_after=0.5)
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.02), 0.1, breaker)})
    world.run(1.0)
    silence(units[1])
    world.run(0.6)
    assert heard[1].states[-1][:2] == (UnitState.LOST, "no answer for 0.5 s")
    assert heard[1].states[-1][2] < 1.0 + 0.52
    assert stations[1].counters.time_outs < 100


def test_slow_poll_alone_does_not_make_a_unit_lost() -> None:
    breaker = BreakerSettings(lost_after=0.5)
    world, _, heard, _ = make_world({1: StationSettings(1, polls(5.0), 0.1, breaker)})
    world.run(30.0)
    assert [state for state, _, _ in heard[1].states] == [UnitState.ONLINE]


def test_refusing_unit_is_there_and_goes_on_being_asked() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.1))})
    units[1].change = refuse()  # type: ignore[assignment]
    world.run(1.0)
    assert [state for state, _, _ in heard[1].states] == [UnitState.ONLINE]
    assert set(heard[1].failures) == {ILLEGAL_ADDRESS}
    assert stations[1].counters.exceptions == {2: stations[1].counters.requests}
    assert stations[1].counters.requests >= 10
    heal(units[1])
    world.run(0.2)
    assert heard[1].values


@pytest.mark.parametrize("code", [0x0A, 0x0B])
def test_gateway_that_says_the_unit_is_silent_is_believed(code: int) -> None:
    world, stations, _, units = make_world({1: StationSettings(1, polls(0.1))})
    world.run(1.0)
    units[1].change = refuse(code)  # type: ignore[assignment]
    world.run(1.0)
    assert state_of(stations[1]) is UnitState.LOST
    assert "gateway" in stations[1].reason


def test_garbage_counts_as_no_answer() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.1))})
    world.run(1.0)
    units[1].change = lambda pdu: pdu[:-1]
    world.run(1.0)
    assert state_of(stations[1]) is UnitState.LOST
    assert stations[1].counters.bad_answers >= 3
    assert all(isinstance(failure, BadAnswer) for failure in heard[1].failures)


def test_write_to_a_unit_that_is_not_there_is_refused_and_not_kept() -> None:
    world, stations, _heard, units = make_world({1: StationSettings(1, polls(0.1), 0.1)})
    assert not stations[1].write("a", write_coil(0, True), world.now)
    world.run(1.0)
    stations[1].write("a", write_coil(0, True), world.now, repeat=0.1)
    world.run(0.2)
    silence(units[1])
    world.run(2.0)
    assert state_of(stations[1]) is UnitState.LOST
    assert not stations[1].write("b", write_coil(1, True), world.now)
    heal(units[1])
    units[1].requests.clear()
    world.run(3.0)
    assert state_of(stations[1]) is UnitState.ONLINE
    assert {pdu[0] for pdu in units[1].requests} == {3}, "nothing old is written"


def test_write_that_only_it_does_not_answer_leaves_the_polls_alone() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.02), 0.1)})
    world.run(1.0)
    units[1].change = lambda pdu: None if pdu[0] == 6 else pdu
    stations[1].write("a", write_register(5, b"\0\x07"), world.now)
    before = len(heard[1].values)
    world.run(2.0)
    assert heard[1].written == [("a", TimedOut(0.1))]
    assert len(heard[1].values) - before > 60
    assert state_of(stations[1]) is UnitState.ONLINE


def test_unit_of_which_nothing_is_read_is_watched() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, (), 0.1, keepalive=0.5)})
    units[1].change = refuse()  # type: ignore[assignment]
    world.run(2.0)
    assert state_of(stations[1]) is UnitState.ONLINE
    assert len(units[1].requests) in range(4, 7)
    assert heard[1].failures == []
    silence(units[1])
    world.run(3.0)
    assert state_of(stations[1]) is UnitState.LOST


def identifying(code: str) -> object:
    content = bytes((0x2B, 0x0E, 1, 1, 0, 0, 1, 1, len(code))) + code.encode()
    return lambda pdu: content if pdu[0] in (0x2B, 0xAB) else pdu


def test_replaced_device_is_noticed_before_its_values() -> None:
    settings = StationSettings(1, polls(0.1), 0.1, is_identified=True, serial=WantedItem(Area.INPUT, 900, 1))
    world, stations, heard, units = make_world({1: settings})
    units[1].change = identifying("A1")  # type: ignore[assignment]
    units[1].registers[900] = 1
    world.run(1.0)
    assert heard[1].order[:3] == ["online", "identified", "values"]
    silence(units[1])
    world.run(2.0)
    units[1].change = identifying("B2")  # type: ignore[assignment]
    units[1].registers[900] = 2
    del heard[1].order[:]
    world.run(2.0)
    assert heard[1].order[:3] == ["online", "identified", "values"]
    identity, former = heard[1].identities[-1]
    assert former is not None
    assert identity.changes(former) == [
        "product code B2 instead of A1",
        "serial number 0002 instead of 0001",
    ]
    assert stations[1].identity == identity


def test_replaced_device_is_noticed_behind_a_connection_that_was_away_for_a_moment() -> None:
    world, _, heard, units = make_world({1: StationSettings(1, polls(0.1), 0.1, is_identified=True)})
    units[1].change = identifying("A1")  # type: ignore[assignment]
    world.run(1.0)
    world.is_reachable = False
    world.run(0.05)
    units[1].change = identifying("B2")  # type: ignore[assignment]
    world.is_reachable = True
    world.run(0.5)
    assert [state for state, _, _ in heard[1].states] == [UnitState.ONLINE]
    assert len(heard[1].identities) == 2


def test_unit_without_identification_loses_nothing_by_being_asked() -> None:
    world, _, heard, _ = make_world({1: StationSettings(1, polls(0.1), 0.1, is_identified=True)})
    world.run(1.0)
    assert len(heard[1].identities) == 1
    assert len(heard[1].values) >= 9


def test_several_requests_of_one_unit_are_underway_where_that_is_allowed() -> None:
    from gatewayd.modbus.client.line import LineSettings

    wanted = [WantedItem(Area.HOLDING, 1000 * number, 1) for number in range(4)]
    settings = StationSettings(1, polls(0.1, *wanted), in_flight=4)
    world, stations, _, units = make_world({1: settings}, LineSettings(in_flight=4))
    units[1].delay = 0.05
    world.run(1.0)
    assert stations[1].counters.answers > 35, "one after the other there would be 20"


def test_request_from_outside_goes_between_the_polls() -> None:
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.02))})
    units[1].registers = {40: 7}
    world.run(0.1)
    answers: list[tuple[object, float]] = []
    assert stations[1].ask(read(Area.HOLDING, 40, 1), lambda outcome, now: answers.append((outcome, now)))
    before = len(heard[1].values)
    world.run(0.1)
    assert [outcome for outcome, _ in answers] == [b"\x00\x07"]
    assert len(heard[1].values) - before >= 4
    assert [pdu for _, _, pdu in world.sent].count(read(Area.HOLDING, 40, 1).pdu) == 1


def test_requests_from_outside_are_bounded_and_end_with_the_unit() -> None:
    world, stations, _, units = make_world({1: StationSettings(1, polls(0.02))})
    answers: list[object] = []

    def ask() -> bool:
        return stations[1].ask(write_coil(5, on=True), lambda outcome, _now: answers.append(outcome))

    assert not ask()
    world.run(0.1)
    silence(units[1])
    assert [ask() for _ in range(MAX_ASKED + 1)] == [True] * MAX_ASKED + [False]
    world.run(3.0)
    assert state_of(stations[1]) is UnitState.LOST
    assert len(answers) == MAX_ASKED
    assert all(isinstance(each, TimedOut | ConnectionLost) for each in answers)
    assert not ask()


def test_connection_that_was_renewed_without_a_loss_is_reported_once_the_unit_answers_on_it() -> None:
    """A device that has begun anew in less than `lost_after` has lost its outputs as well."""
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.02))})
    world.run(0.5)
    assert "renewed" not in heard[1].order
    world.close("reset")
    world.run(0.5)
    assert heard[1].order.count("renewed") == 1
    silence(units[1])
    world.run(3.0)
    assert state_of(stations[1]) is UnitState.LOST
    world.close("reset")
    heal(units[1])
    world.run(3.0)
    assert state_of(stations[1]) is UnitState.ONLINE
    assert heard[1].order.count("renewed") == 1
