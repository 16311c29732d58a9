"""The link to one device: what its station says becomes values, owners and words; what changes becomes writes."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import pytest

from gatewayd.links.access import AccessError, PlaceRequest
from gatewayd.links.contract import Level
from gatewayd.links.devices.modbus.link import ModbusDeviceLink
from gatewayd.links.devices.status_words import DeviceState
from gatewayd.loop import clock
from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.identity import UnitIdentity
from gatewayd.modbus.client.requests import ExceptionAnswer, Failure, ModbusRequest, TimedOut
from gatewayd.modbus.client.station import Answered
from gatewayd.modbus.client.unit import UnitState
from tests.links.devices.cells import HEAD, VARIABLES, FakeRobot, device, planned


class Bench:
    """A link whose station is told what to say, and whose writes are kept."""

    def __init__(self, variables: str = VARIABLES, head: str = HEAD, name: str = "island") -> None:
        self.plan = planned(variables, head)
        self.robot = FakeRobot(self.plan)
        self.now = clock.now()
        self.robot.fresh(self.now)
        self.link = ModbusDeviceLink(device(self.plan, name), self.robot.cell)
        self.written: list[tuple[Hashable, str]] = []
        self.link.station.write = self._write  # type: ignore[method-assign,assignment]

    def _write(self, key: Hashable, order: Any, _now: float, **_more: object) -> bool:
        self.written.append((key, order.pdu.hex()))
        return True

    def there(self) -> None:
        self.link.station.state = UnitState.ONLINE
        self.link.state_changed(UnitState.ONLINE, "", self.now)

    def lost(self) -> None:
        self.link.station.state, self.link.station.reason = UnitState.LOST, "no answer for 1 s"
        self.link.state_changed(UnitState.LOST, "no answer for 1 s", self.now)

    def say(self, area: Area, data: bytes) -> None:
        groups = [group for poll in self.link.station.settings.polls for group in poll.groups]
        (group,) = (group for group in groups if group.area is area)
        self.link.values_read(group, data, self.now)

    def refuse(self, area: Area) -> None:
        groups = [group for poll in self.link.station.settings.polls for group in poll.groups]
        (group,) = (group for group in groups if group.area is area)
        self.link.read_failed(group, ExceptionAnswer(2), self.now)

    def figure(self, name: str) -> str:
        return str(self.link.health().figures[name])


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_what_is_read_is_written_to_the_robot(bench: Bench) -> None:
    bench.there()
    bench.say(Area.DISCRETE, b"\x01")
    bench.say(Area.INPUT, b"\x00\x7d")
    assert (bench.robot.value("present"), bench.robot.value("level")) == (True, 12.5)
    assert bench.robot.owner("level") == "island"
    assert bench.link.reachable


def test_a_lost_device_is_a_lost_writer(bench: Bench) -> None:
    bench.there()
    bench.say(Area.DISCRETE, b"\x01")
    bench.lost()
    assert (bench.robot.value("present"), bench.robot.owner("present")) == (False, "")
    health = bench.link.health()
    assert (health.level, health.figures["state"]) == (Level.BAD, "lost")
    assert "no answer for 1 s" in health.problems[0]
    assert bench.robot.cell.health.tables["devices"][0][0] == 4


def test_a_value_that_the_device_refuses_leaves_the_others(bench: Bench) -> None:
    bench.there()
    bench.say(Area.DISCRETE, b"\x01")
    bench.refuse(Area.INPUT)
    assert bench.figure("state") == "partial"
    assert "`level` cannot be read: exception 02" in bench.figure("reason")
    bench.say(Area.INPUT, b"\x00\x01")
    assert bench.figure("state") == "good"


def test_a_device_that_refuses_everything_is_not_there_in_part() -> None:
    bench = Bench()
    bench.there()
    bench.refuse(Area.DISCRETE)
    bench.refuse(Area.INPUT)
    assert bench.figure("state") == "partial", "one of three places has not been asked for yet"
    bench.refuse(Area.HOLDING)
    health = bench.link.health()
    assert (health.level, health.figures["state"], health.figures["up"]) == (Level.BAD, "refusing", 0)
    assert health.problems[0].startswith("device island refuses everything: ")
    assert "look at the number of the unit" in health.problems[0]
    # What it takes is something, until it takes that no more.
    key = (Area.COIL, 0, None)
    bench.link.write_done(key, None, bench.now)
    assert bench.figure("state") == "partial"
    bench.link.write_done(key, ExceptionAnswer(2), bench.now)
    assert bench.figure("state") == "refusing"
    bench.say(Area.INPUT, b"\x00\x01")
    assert bench.figure("state") == "partial"


def test_a_device_that_is_only_written_and_refuses_that_refuses_everything() -> None:
    bench = Bench(name="gripper")
    bench.link.station.write = lambda *_order: True  # type: ignore[method-assign]
    bench.there()
    assert bench.figure("state") == "good"
    bench.link.write_done((Area.HOLDING, 1002, 0xFF), ExceptionAnswer(1), bench.now)
    assert bench.figure("state") == "refusing"


def test_an_output_that_changes_is_written(bench: Bench) -> None:
    bench.there()
    bench.robot.fresh(bench.now, clamp=True)
    assert bench.written == [((Area.COIL, 0, None), "050000ff00")]


def test_a_write_that_is_refused_is_seen_until_one_is_taken(bench: Bench) -> None:
    bench.there()
    key = (Area.COIL, 0, None)
    bench.link.write_done(key, ExceptionAnswer(4), bench.now)
    assert "`clamp` was not written: exception 04" in bench.figure("reason")
    bench.link.write_done(key, None, bench.now)
    assert bench.figure("state") == "good"


@pytest.mark.parametrize(
    "failure, again", [(TimedOut(0.3), 1), (ExceptionAnswer(6), 1), (ExceptionAnswer(2), 0)]
)
def test_a_write_that_is_lost_is_made_again_and_one_that_is_refused_is_not(
    bench: Bench, failure: Failure, again: int
) -> None:
    bench.there()
    bench.robot.fresh(bench.now, clamp=True)
    bench.written.clear()
    bench.link.write_done((Area.COIL, 0, None), failure, bench.now)
    bench.link._tick(bench.now + 1.1)
    assert len(bench.written) == again
    assert bench.figure("state") == "partial"


def test_parts_of_a_register_are_written_on_connect() -> None:
    bench = Bench(name="gripper")
    orders: list[tuple[int, int, int]] = []

    def write(_key: Hashable, order: Any, _now: float, **_more: object) -> bool:
        orders.append((order.address, order.mask, order.value))
        return True

    bench.link.station.write = write  # type: ignore[method-assign,assignment]
    bench.robot.fresh(bench.now, force=7)
    bench.there()
    assert orders == [(1002, 0xFF, 7)]
    assert bench.link.reachable is None


def test_another_device_is_reported_in_words(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    bench.there()
    former = UnitIdentity(objects=((0, "WAGO"), (1, "750-352")))
    bench.link.identified(former, None, bench.now)
    bench.link.identified(former, former, bench.now)
    assert "another device" not in caplog.text
    bench.link.identified(UnitIdentity(objects=((0, "Beckhoff"), (1, "750-352"))), former, bench.now)
    (record,) = [record for record in caplog.records if "another device" in record.message]
    assert vars(record)["fields"]["detail"] == "vendor Beckhoff instead of WAGO"


def test_another_link_takes_its_place(bench: Bench) -> None:
    bench.there()
    bench.say(Area.DISCRETE, b"\x01")
    (requester,) = bench.link.departing(None, bench.plan.cell)
    assert requester.writer == 0
    bench.link.release(None, bench.plan.cell, bench.now)
    assert bench.robot.owner("present") == ""
    bench.lost()
    assert bench.link.departing(None, bench.plan.cell) == {}


def test_it_goes_on_in_another_cell(bench: Bench) -> None:
    bench.there()
    bench.say(Area.DISCRETE, b"\x01")
    more = planned("  new: {robot: input_int_register_9, modbus: 9, owner: plc}\n" + VARIABLES)
    other = FakeRobot(more)
    other.fresh(bench.now)
    bench.link.rebind(device(more, "island"), other.cell, bench.now)
    bench.robot = other
    bench.say(Area.INPUT, b"\x00\x7d")
    assert other.value("level") == 12.5
    other.fresh(bench.now, clamp=True)
    assert bench.written == [((Area.COIL, 0, None), "050000ff00")]
    assert other.cell.health.tables["devices"][0][0] == 2


def test_answers_that_waited_while_the_process_stood_still_are_no_news(bench: Bench) -> None:
    bench.there()
    bench.say(Area.INPUT, b"\x00\x01")
    bench.link.gap(bench.now - 5, bench.now)
    bench.say(Area.INPUT, b"\x00\x7d")
    assert bench.robot.value("level") == pytest.approx(0.1)
    bench.link._tick(bench.now)
    bench.say(Area.INPUT, b"\x00\x7d")
    assert bench.robot.value("level") == 12.5


async def test_place_is_asked_by_hand(bench: Bench) -> None:
    with pytest.raises(AccessError, match="device island is not asked: it has not answered yet"):
        await bench.link.ask(PlaceRequest("100"))
    bench.there()
    asked: list[bytes] = []

    def ask(request: ModbusRequest, answered: Answered) -> bool:
        asked.append(request.pdu)
        answered(b"\x00\x07", bench.now)
        return True

    bench.link.station.ask = ask  # type: ignore[method-assign]
    assert (await bench.link.ask(PlaceRequest("100"))).values[0].value == 7
    assert [pdu.hex() for pdu in asked] == ["0300640001"]


def test_state_lasts_since_it_was_seen_first(bench: Bench) -> None:
    bench.there()
    bench.link._tick(bench.now)
    bench.link._tick(bench.now + 5.0)
    assert bench.link._state_since == (DeviceState.GOOD, bench.now)
    bench.lost()
    bench.link._tick(bench.now + 9.0)
    assert bench.link._state_since == (DeviceState.LOST, bench.now + 9.0)
