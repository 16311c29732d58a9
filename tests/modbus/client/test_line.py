from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.conversation import RtuConversation
from gatewayd.modbus.client.grouping import WantedItem
from gatewayd.modbus.client.line import MAX_BROADCASTS, ConnectionUse, Line, LineSettings
from gatewayd.modbus.client.requests import ConnectionLost, write_coil, write_register
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.timing import RtuTiming
from gatewayd.modbus.client.unit import StationSettings, UnitState
from tests.modbus.client.world import Heard, Unit, World, make_world, polls

TIMEOUT = 0.3


def units_of(count: int, period: float = 0.05) -> dict[int, StationSettings]:
    return {number: StationSettings(number, polls(period), TIMEOUT) for number in range(1, count + 1)}


def silence(unit: Unit) -> None:
    unit.change = lambda _: None


def heal(unit: Unit) -> None:
    unit.change = lambda pdu: pdu


def test_stations_are_served_in_turn_though_one_wants_more() -> None:
    many = [WantedItem(Area.HOLDING, 1000 * number, 1) for number in range(20)]
    world, _, _, _ = make_world(
        {
            1: StationSettings(1, polls(0.0, *many)),
            2: StationSettings(2, polls(0.0)),
            3: StationSettings(3, polls(0.0)),
        }
    )
    world.run(3.0)
    counts = [sum(unit == number for _, unit, _ in world.sent) for number in (1, 2, 3)]
    assert max(counts) - min(counts) <= 2


def test_writes_do_not_keep_others_from_being_read() -> None:
    world, stations, heard, _ = make_world(units_of(2))

    def write_again(number: int) -> None:
        stations[1].write(number, write_coil(number, True), world.now)

    world.run(0.5)
    heard[1].when_written = lambda key: write_again(int(str(key)) ^ 8)
    for number in range(8):
        write_again(number)
    before = len(heard[2].values)
    world.run(2.0)
    assert stations[1].counters.writes > 500
    assert len(heard[2].values) - before > 35


def test_time_out_costs_one_request_and_not_the_connection() -> None:
    world, stations, _, units = make_world(units_of(2))
    world.run(1.0)
    units[2].change = lambda pdu: None if len(units[2].requests) % 20 == 0 else pdu
    world.run(10.0)
    assert world.breaks == 0
    assert world.line.connections == 1
    assert stations[2].counters.time_outs > 3
    assert stations[2].state is UnitState.ONLINE


@pytest.mark.parametrize("in_flight", [1, 4])
def test_silent_units_cost_the_others_less_than_a_twentieth(in_flight: int) -> None:
    """32 units of which 4 fall silent; each answers after 2 ms, so a round takes a little more than its 100 ms."""
    world, stations, heard, units = make_world(units_of(32, 0.1), LineSettings(in_flight=in_flight))
    world.run(10.0)
    before = sum(len(one.values) for one in heard.values())
    for number in (5, 6, 20, 31):
        silence(units[number])
    world.run(10.0)  # they are lost in it
    assert [number for number, own in stations.items() if own.state is UnitState.LOST] == [5, 6, 20, 31]
    for one in heard.values():
        one.values.clear()
    world.run(50.0)
    alive = [len(one.values) / 5 for number, one in heard.items() if number not in (5, 6, 20, 31)]
    assert sum(alive) / 28 > 0.95 * before / 32
    probes = [at for at, unit, _ in world.sent if unit in (5, 6, 20, 31) and at > 20]
    assert 4 <= len(probes) <= 0.05 * 50 / TIMEOUT + 1
    assert {unit for at, unit, _ in world.sent if at > 20} == set(range(1, 33)), "each of them is probed"
    heal(units[5])
    world.run(4 * 20 * TIMEOUT + 1)
    assert stations[5].state is UnitState.ONLINE


def test_units_that_are_silent_from_the_start_do_not_hold_up_the_others() -> None:
    world, stations, _, units = make_world(units_of(8))
    for number in (1, 3, 5):
        silence(units[number])
    world.run(3 * TIMEOUT + 0.2)
    assert [number for number, own in stations.items() if own.state is UnitState.ONLINE] == [2, 4, 6, 7, 8]


def test_silent_units_at_the_start_cost_no_other_its_place() -> None:
    """Four time-outs in a row would take longer than `lost_after`."""
    units = {
        number: StationSettings(number, polls(0.1), TIMEOUT, BreakerSettings(lost_after=1.0))
        for number in range(1, 33)
    }
    world, stations, _, answering = make_world(units)
    for number in range(29, 33):
        silence(answering[number])
    world.run(20.0)
    assert [own.counters.losses for own in stations.values()] == [0] * 32
    assert sum(own.state is UnitState.ONLINE for own in stations.values()) == 28


def test_units_that_were_late_together_are_found_together_though_others_stay_away() -> None:
    world, stations, _, units = make_world(units_of(12))
    for number in (1, 2, 3):
        silence(units[number])
    world.run(10.0)
    for number in (4, 5, 6, 7, 8):
        silence(units[number])
    world.run(3.0)
    assert [number for number, own in stations.items() if own.state is UnitState.ONLINE] == [9, 10, 11, 12]
    stations[9].counters.losses = 0
    for number in (4, 5, 6, 7, 8):
        heal(units[number])
    world.run(20 * TIMEOUT * 4)
    assert [number for number, own in stations.items() if own.state is UnitState.ONLINE] == list(range(4, 13))


def test_units_that_come_back_together_are_found_together() -> None:
    """Power of the cabinet is off and on again, while two more stay away."""
    world, stations, _, units = make_world(units_of(10))
    world.run(1.0)
    for unit in units.values():
        silence(unit)
    world.run(30.0)
    assert not any(own.state is UnitState.ONLINE for own in stations.values())
    for number in range(1, 9):
        heal(units[number])
    world.run(1.0 + 10 * 2 * TIMEOUT)
    assert [number for number, own in stations.items() if own.state is UnitState.ONLINE] == list(range(1, 9))


def test_garbled_unit_does_not_take_others_with_it() -> None:
    world, stations, heard, units = make_world(units_of(3))
    world.run(1.0)
    units[2].change = lambda pdu: pdu[:-1]
    world.run(5.0)
    assert [own.state for own in stations.values()] == [UnitState.ONLINE, UnitState.LOST, UnitState.ONLINE]
    assert min(len(heard[1].values), len(heard[3].values)) > 100


def test_connection_that_ends_is_blamed_on_the_first_underway() -> None:
    world, stations, _, units = make_world(units_of(3), LineSettings(in_flight=3))
    world.run(1.0)
    for unit in units.values():
        unit.delay = 10.0
    world.run(0.08)
    assert len(world.line._conversation.jobs) == 3  # type: ignore[union-attr]
    first = world.line._conversation.jobs[0].unit  # type: ignore[union-attr]
    world.line.disconnected("broken", world.now)
    assert {number: own.breaker.failures for number, own in stations.items()} == {
        number: int(number == first) for number in (1, 2, 3)
    }
    assert all(own.counters.lost_requests == 1 for own in stations.values())


def test_line_without_connection_loses_its_units_in_time_and_says_why() -> None:
    world, stations, heard, _ = make_world(
        {1: StationSettings(1, polls(0.05), TIMEOUT, BreakerSettings(lost_after=0.7))}
    )
    world.run(1.0)
    world.is_reachable = False
    world.run(0.5)
    assert stations[1].state is UnitState.ONLINE
    world.run(0.5)
    assert heard[1].states[-1][:2] == (UnitState.LOST, "the cable was pulled")
    assert heard[1].states[-1][2] < 1.8
    world.is_reachable = True
    world.run(0.1)
    assert stations[1].state is UnitState.ONLINE


def test_connection_on_which_nobody_answers_is_opened_again() -> None:
    world, stations, _, units = make_world(units_of(2))
    world.line.silence_limit = 5.0
    world.run(1.0)
    silence(units[1])
    world.run(20.0)
    assert world.line.connections == 1, "the other unit answers"
    silence(units[2])
    world.run(20.0)
    assert world.line.connections in range(3, 6)
    assert world.line.trouble == ""
    heal(units[2])
    world.run(2.0)
    assert stations[2].state is UnitState.ONLINE
    connections = world.line.connections
    world.run(20.0)
    assert world.line.connections == connections


def test_unit_that_was_never_there_is_lost_when_there_is_no_connection() -> None:
    heard = Heard()
    line = Line(LineSettings(), [Station(StationSettings(1, polls()), heard)])
    line.disconnected("127.0.0.1:502: Connection refused", 5.0)
    assert heard.states == [(UnitState.LOST, "127.0.0.1:502: Connection refused", 5.0)]


def test_units_may_come_and_go_at_work() -> None:
    world, stations, heard, units = make_world(units_of(2))
    world.run(1.0)
    world.line.next_frame(world.now)
    world.line.remove(stations[1], world.now)
    assert heard[1].states[-1][:2] == (UnitState.LOST, "it is not asked any more")
    heard[1].values.clear()
    units[3] = Unit()
    heard[3] = Heard()
    world.line.add(Station(StationSettings(3, polls()), heard[3]))
    world.run(1.0)
    assert heard[1].values == []
    assert heard[3].values
    assert len(heard[2].values) > 35


def test_pause_between_requests_is_kept() -> None:
    world, _, _, _units = make_world(units_of(2, 0.0), LineSettings(pause=0.05))
    world.run(1.0)
    times = [at for at, _, _ in world.sent]
    assert min(later - earlier for earlier, later in itertools.pairwise(times)) >= 0.0519


def test_one_connection_for_each_request() -> None:
    world, stations, heard, _ = make_world(
        {1: StationSettings(1, polls(0.1), TIMEOUT, is_identified=True)},
        LineSettings(use=ConnectionUse.PER_REQUEST),
    )
    line = world.line
    world.run(1.0)
    assert stations[1].state is UnitState.ONLINE
    assert line.connections - 1 <= stations[1].counters.requests <= line.connections
    assert len(heard[1].identities) == 1


def serial_world(count: int = 1) -> tuple[World, dict[int, Station], dict[int, Unit]]:
    world, stations, _, units = make_world(units_of(count))
    world.use(lambda: RtuConversation(RtuTiming.of(115_200)))
    return world, stations, units


@pytest.mark.parametrize("delay", [number / 20 for number in range(1, 40)])
def test_late_answer_on_a_serial_line_is_not_taken_for_that_of_another_place(delay: float) -> None:
    """Two places that differ by nothing but their address, in a unit that is slow from one moment to the next."""
    places = WantedItem(Area.HOLDING, 10, 1), WantedItem(Area.HOLDING, 20, 1)
    world, stations, heard, units = make_world(
        {1: StationSettings(1, polls(0.05, *places), TIMEOUT), 2: StationSettings(2, polls(0.05), TIMEOUT)}
    )
    world.use(lambda: RtuConversation(RtuTiming.of(115_200)))
    units[1].registers = {10: 10, 20: 20}
    world.run(1.0)
    units[1].delay = delay
    world.run(10.0)
    assert stations[2].state is UnitState.ONLINE
    units[1].delay = 0.002
    world.run(15.0)
    assert stations[1].state is UnitState.ONLINE
    assert {(group.address, data) for group, data in heard[1].values} == {(10, b"\0\x0a"), (20, b"\0\x14")}


def test_answer_that_is_missing_on_a_serial_line_costs_its_unit_no_more_than_some_time_outs() -> None:
    places = WantedItem(Area.HOLDING, 10, 1), WantedItem(Area.HOLDING, 20, 1)
    world, stations, heard, units = make_world({1: StationSettings(1, polls(0.05, *places), TIMEOUT)})
    world.use(lambda: RtuConversation(RtuTiming.of(115_200)))
    world.run(1.0)
    silence(units[1])
    world.run(0.1)
    heal(units[1])
    for one in heard.values():
        one.values.clear()
    world.run(4 * TIMEOUT)
    assert {group.address for group, _ in heard[1].values} == {10, 20}
    assert stations[1].counters.losses == 0


def test_broadcast_goes_to_all_and_is_bounded() -> None:
    world, stations, _units = serial_world()
    world.run(0.5)
    assert world.line.broadcast(write_register(1, b"\0\1"))
    world.run(0.5)
    assert [pdu.hex() for _, unit, pdu in world.sent if unit == 0] == ["0600010001"]
    assert stations[1].state is UnitState.ONLINE
    taken = [world.line.broadcast(write_register(1, b"\0\1")) for _ in range(MAX_BROADCASTS + 1)]
    assert taken == [True] * MAX_BROADCASTS + [False]


@given(st.lists(st.binary(max_size=40), max_size=30), st.booleans())
@settings(max_examples=60, deadline=None)
def test_hostile_bytes_never_raise_and_the_line_goes_on(chunks: list[bytes], is_serial: bool) -> None:
    world, stations, _, _ = make_world(units_of(1))
    if is_serial:
        world.use(lambda: RtuConversation(RtuTiming.of(115_200)))
    world.run(0.1)
    for chunk in chunks:
        if world.line.is_connected:
            world.close(world.line.received(chunk, world.now))
        world.run(0.01)
    world.run(20 * TIMEOUT + 5)
    assert stations[1].state is UnitState.ONLINE
    for own in stations.values():
        assert own.in_flight <= 1


def test_lost_reads_are_reported_and_tried_again() -> None:
    world, _, heard, units = make_world(units_of(1))
    world.run(0.1)
    units[1].delay = 10
    world.run(0.06)
    world.close("broken")
    units[1].delay = 0.002
    world.run(0.2)
    assert heard[1].failures == [ConnectionLost("broken")]
    assert heard[1].order[-1] == "values"


def test_time_in_which_the_process_stood_still_is_no_silence() -> None:
    """Neither of a unit that was asked last nor of the connection: the answers are there, and not read yet."""
    world, stations, heard, units = make_world(units_of(2))
    world.run(1.0)
    for unit in units.values():
        unit.delay = 0.2
    world.run(0.1)
    assert world.line._conversation.jobs  # type: ignore[union-attr]
    world.line.gap(10.0)
    assert world.line.check(world.now + 10.0) == ""
    assert [own.counters.time_outs for own in stations.values()] == [0, 0]
    assert [own.state for own in stations.values()] == [UnitState.ONLINE, UnitState.ONLINE]
    assert heard[1].failures == []
