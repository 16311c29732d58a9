"""What a device says as a writer of the cell."""

from __future__ import annotations

import math

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.definition import Value
from gatewayd.core.events import EventKind
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.links.devices.inflow import Inflow
from tests.links.devices.cells import NOW, FakeRobot, device, planned

PLC = Requester(1)


class Island:
    """The device of a cell."""

    def __init__(self, robot: FakeRobot) -> None:
        plan = device(planned(), "island")
        self.robot = robot
        inputs = [placed.variable for placed in plan.inputs(robot.cell.definition)]
        self.inflow = Inflow(robot.cell, plan.writer, "island", inputs, 1.0)

    def say(self, now: float = NOW, **values: Value | None) -> None:
        self.inflow.receive([(self.robot.index[name], value) for name, value in values.items()], now)

    def refusals(self) -> list[object]:
        events = self.robot.cell.events.since(0)
        return [event.reason for _, event in events if event.kind is EventKind.REFUSED]


@pytest.fixture
def island() -> Island:
    robot = FakeRobot(planned())
    robot.fresh()
    return Island(robot)


def test_an_answer_writes_and_owns(island: Island) -> None:
    island.say(present=True, level=12.5)
    assert (island.robot.value("present"), island.robot.value("level")) == (True, 12.5)
    assert island.robot.owner("present") == island.robot.owner("level") == "island"
    assert island.robot.cell.writers.alive[0]


def test_an_equal_answer_keeps_the_value_young(island: Island) -> None:
    island.say(present=True)
    island.say(NOW + 0.5, present=True)
    assert island.robot.cell.image.age(island.robot.index["present"], NOW + 0.5) == 0


def test_a_lost_device_owns_nothing_any_more(island: Island) -> None:
    island.say(present=True, level=12.5)
    island.inflow.lose("no answer for 1 s", NOW + 1)
    assert (island.robot.value("present"), island.robot.value("level")) == (False, 0)
    assert island.robot.owner("present") == ""
    assert not island.robot.cell.writers.alive[0]
    island.say(NOW + 2, present=True)
    assert island.robot.owner("present") == "island"


def test_what_was_not_read_for_long_is_released_though_the_device_answers(island: Island) -> None:
    island.say(present=True, level=12.5)
    island.say(NOW + 0.9, present=True)
    assert island.inflow.expire(NOW + 1.1) == [island.robot.index["level"]]
    assert (island.robot.value("present"), island.robot.value("level")) == (True, 0)
    assert island.robot.index["level"] in island.inflow.lacking


@pytest.mark.parametrize("value", [200.0, None, math.nan])
def test_a_value_that_may_not_be_is_refused_once_and_leaves_no_older_one(
    island: Island, value: float | None
) -> None:
    island.say(present=True, level=12.5)
    for _ in range(3):
        island.say(present=True, level=value)
    assert island.refusals() == [Reason.OUT_OF_LIMITS]
    assert (island.robot.value("level"), island.robot.owner("level")) == (0, "")
    assert island.robot.value("present") is True
    island.say(level=20.0)
    assert island.robot.value("level") == 20.0


def test_a_plc_that_ranks_higher_keeps_what_it_took(island: Island) -> None:
    island.say(speed=100)
    assert island.robot.owner("speed") == "island"
    index = island.robot.index["speed"]
    assert island.robot.cell.write(PLC, [Change(index, 5)], NOW) is None
    for _ in range(3):
        island.say(present=True, speed=100)
    assert island.refusals() == [Reason.HELD]
    assert island.robot.cell.health.writes_refused == 1
    assert (island.robot.value("speed"), island.robot.owner("speed")) == (5, "plc")
    island.say(speed=101)
    assert island.robot.cell.health.writes_refused == 2


def test_it_has_its_turn_when_the_lease_of_the_plc_ends(island: Island) -> None:
    island.robot.cell.write(PLC, [Change(island.robot.index["speed"], 5)], NOW)
    island.say(speed=100)
    island.robot.cell.tick(NOW + 6)
    island.say(NOW + 6, speed=100)
    assert (island.robot.value("speed"), island.robot.owner("speed")) == (100, "island")


def test_nothing_is_asked_for_before_the_robot_is_there() -> None:
    robot = FakeRobot(planned())
    island = Island(robot)
    island.say(present=True)
    assert island.refusals() == []
    assert robot.cell.health.writes_refused == 0
    robot.fresh()
    island.say(present=True)
    assert robot.value("present") is True


def test_a_group_waits_for_all_that_the_device_has_of_it() -> None:
    plan = planned(
        "  x: {robot: input_int_register_0, device: {at: island, holding: 0}, group: pose}\n"
        "  y: {robot: input_int_register_1, device: {at: island, holding: 9}, group: pose}\n"
        "  force: {robot: output_int_register_7, device: {at: gripper, holding: 1}}\n",
        _GROUP_HEAD,
    )
    robot = FakeRobot(plan)
    robot.fresh()
    inflow = Inflow(robot.cell, device(plan, "island").writer, "island", [0, 1], 1.0)
    inflow.receive([(0, 7)], NOW)
    assert robot.owner("x") == ""
    inflow.receive([(1, 8)], NOW)
    assert (robot.value("x"), robot.value("y"), robot.owner("x")) == (7, 8, "island")


_GROUP_HEAD = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
devices:
  island: {modbus: '127.0.0.1:1503', watchdog: none}
  gripper: {serial: /dev/ttyUSB0, baudrate: 115200, watchdog: none}
writers:
  island: {device: island}
groups:
  pose: {owner: island}
variables:
"""


def test_it_goes_on_in_the_successor_of_the_cell(island: Island) -> None:
    island.say(present=True)
    connection = island.inflow.requester.connection
    other = FakeRobot(planned("  new: {robot: input_int_register_9, modbus: 9, owner: plc}\n" + _variables()))
    other.fresh()
    indices = {index: other.index[name] for name, index in island.robot.index.items()}
    island.inflow.rebind(other.cell, 0, indices)
    island.robot = other
    island.say(present=True)
    assert island.inflow.requester.connection == connection
    assert other.value("present") is True


def _variables() -> str:
    from tests.links.devices.cells import VARIABLES

    return VARIABLES
