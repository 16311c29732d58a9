"""One CANopen device joined to a cell: values in both directions, losses, EMCY, a reload."""

from __future__ import annotations

from uuid import uuid4

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.access import AccessError, PlaceRequest
from gatewayd.links.contract import Level
from gatewayd.links.devices.canopen.link import FAMILY, CanopenDeviceLink
from gatewayd.links.devices.declaration import KIND
from gatewayd.loop import clock
from tests.links.canopen_node.recorder import until
from tests.links.devices.canopen.cells import VARIABLES, an_encoder, link_of, managed, planned, the_device
from tests.links.devices.cells import FakeRobot


@pytest.fixture
def channel() -> str:
    return str(uuid4())


async def test_values_go_both_ways(channel: str) -> None:
    """By PDO as the data sheet has them, and by SDO what no PDO carries."""
    plan = planned(channel=channel)
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel) as encoder, managed([link]):
        robot.fresh(clock.now(), clamp=9, speed=300)
        await until(lambda: robot.value("position") == 1.5)
        await until(lambda: robot.value("preset") == 41)
        assert robot.owner("position") == "encoder"
        # What is written on connect is there; what waits for a change is not.
        await until(lambda: encoder.get(0x2002) == 300)
        assert encoder.get(0x6200, 1) == 0
        robot.fresh(clock.now(), clamp=10, speed=300)
        await until(lambda: encoder.get(0x6200, 1) == 10)
        encoder.set(0x6004, 2500)
        await until(lambda: robot.value("position") == 2.5)
        encoder.set(0x2000, 42)
        await until(lambda: robot.value("preset") == 42)
        health = link.health()
        assert (health.level, health.problems) == (Level.GOOD, ())
        assert health.figures["state"] == "good"
        assert health.figures["nmt_state"] == "operational"
        assert set(health.figures) - {"up"} <= set(KIND.fields)


async def test_value_that_does_not_change_stays_good_by_the_heartbeat(channel: str) -> None:
    plan = planned(channel=channel, more=", lost_after: 900ms", heartbeat="900ms")
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel), managed([link]):
        robot.fresh(clock.now())
        await until(lambda: robot.owner("position") == "encoder")
        before = clock.now()
        await until(lambda: clock.now() - before > 1.1)
        assert robot.owner("position") == "encoder"


async def test_lost_device_is_a_lost_writer_and_comes_back(channel: str) -> None:
    plan = planned(channel=channel, heartbeat="900ms")
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel) as encoder, managed([link]):
        robot.fresh(clock.now())
        await until(lambda: robot.owner("position") == "encoder")
        encoder.network.silent = True
        await until(lambda: robot.owner("position") == "")
        state = link.health()
        assert state.figures["state"] == "lost"
        assert str(state.figures["reason"]).startswith("E heartbeat lost (silent for 0.9 s)")
        encoder.network.silent = False
        await until(lambda: robot.owner("position") == "encoder", 8.0)
        assert link.health().figures["heartbeat_misses"] == 1


async def test_emergency_is_seen_until_it_is_over(channel: str) -> None:
    plan = planned(channel=channel)
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel) as encoder, managed([link]):
        await until(lambda: link.health().figures["state"] == "good")
        encoder.node.emcy.set(0x4210, 9, b"\1")
        await until(lambda: link.health().figures["state"] == "partial")
        health = link.health()
        (problem,) = health.problems
        assert problem == (
            "device encoder is there in part: it reports 4210h device temperature too high, "
            "error register 09h (temperature), manufacturer 01 00 00 00 00"
        )
        encoder.node.emcy.set(0, 0)
        await until(lambda: link.health().figures["state"] == "good")
        assert link.health().figures["emergencies"] == 2


async def test_another_device_is_refused_with_its_letter(channel: str) -> None:
    plan = planned(channel=channel)
    link = link_of(plan, FakeRobot(plan).cell)
    async with an_encoder(channel) as encoder, managed([link]):
        await until(lambda: link.health().figures["state"] == "good")
        encoder.set(0x1018, 7, 1)
        encoder.node.nmt.reset()
        await until(lambda: link.health().figures["letter"] == "D")
        assert "another vendor (1018h:01: is 00000007h instead of 000001F0h)" in link.health().problems[0]


async def test_object_that_is_not_there_costs_its_own_variable(channel: str) -> None:
    more = "  level: {robot: input_int_register_5, device: {at: encoder, object: 0x6030}, owner: encoder}\n"
    plan = planned(VARIABLES + more, channel)
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel), managed([link]):
        robot.fresh(clock.now())
        await until(lambda: robot.owner("position") == "encoder")
        await until(lambda: link.health().figures["state"] == "partial")
        assert link.health().figures["reason"] == "`level` cannot be read: 06020000h no such object"
        assert robot.owner("level") == ""


async def test_device_that_refuses_all_objects_is_not_there_in_part(channel: str) -> None:
    """None of its objects goes by a PDO, so nothing comes from it, although it is operational."""
    nothing = (
        "  level: {robot: input_int_register_5, device: {at: encoder, object: 0x6030}, owner: encoder}\n"
    )
    plan = planned(nothing, channel)
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel), managed([link]):
        robot.fresh(clock.now())
        await until(lambda: link.health().figures["state"] == "refusing")
        assert (link.health().level, link.health().figures["up"]) == (Level.BAD, 0)
        assert (
            link.health().problems[0].startswith("device encoder refuses everything: `level` cannot be read")
        )


async def test_reload_goes_on_with_the_same_device(channel: str) -> None:
    plan = planned(channel=channel)
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    async with an_encoder(channel) as encoder, managed([link]) as buses:
        robot.fresh(clock.now())
        await until(lambda: robot.owner("position") == "encoder")
        before = "  first: {robot: input_int_register_9, modbus: 0, owner: plc}\n"
        after = planned(before + VARIABLES, channel)
        assert KIND.fits(the_device(plan), the_device(after), plan.cell, after.cell)
        successor = FakeRobot(after)
        successor.fresh(clock.now())
        link.rebind(the_device(after), successor.cell, clock.now())
        buses.serve([link], {})
        encoder.set(0x6004, 7000)
        await until(lambda: successor.value("position") == 7.0)
        assert link.health().figures["boots"] == 1
        # Another scale is another device: the link ends.
        other = planned(VARIABLES.replace("0.001", "0.01"), channel)
        assert not KIND.fits(the_device(after), the_device(other), after.cell, other.cell)
        link.release(None, other.cell, clock.now())
        assert successor.owner("position") == ""


def test_gap_of_our_own_makes_no_value_old() -> None:
    plan = planned(heartbeat="900ms")
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    robot.fresh(100.0)
    link.node_started(100.0)
    link.pdo_received(0, [1500], 100.0)
    link.gap(100.5, 160.0)
    assert robot.owner("position") == "encoder"
    link._tick(160.1)
    assert robot.owner("position") == "encoder"
    link._tick(170.0)
    assert robot.owner("position") == ""


def test_value_that_comes_with_sync_is_good_only_while_it_comes() -> None:
    plan = planned(
        VARIABLES.replace("0x6004,", "0x6004, pdo: 1,"),
        more=", transmission: sync, sync: 10ms",
        heartbeat="900ms",
    )
    robot = FakeRobot(plan)
    link = link_of(plan, robot.cell)
    robot.fresh(100.0)
    link.node_started(100.0)
    link.pdo_received(0, [1500], 100.0)
    for second in range(1, 4):
        link.node_seen(100.0 + second)
        link._tick(100.0 + second)
    assert robot.owner("position") == ""


def test_departing_writer_is_named() -> None:
    plan = planned()
    cell = Cell(plan.cell)
    link = link_of(plan, cell)
    assert link.departing(None, plan.cell) == {}
    link.node_started(1.0)
    assert list(link.departing(None, plan.cell).values()) == ["the device encoder changes or ends"]
    assert link.departing(the_device(plan), plan.cell) == {}


def test_heartbeat_of_the_manager_needs_the_core() -> None:
    plan = planned()
    cell = Cell(plan.cell)
    link = link_of(plan, cell)
    assert link.core_lives(1.0)
    assert link.core_lives(1.4)
    assert not link.core_lives(1.6)
    cell.health.heartbeat += 1
    assert link.core_lives(1.6)


def test_made_by_its_family() -> None:
    plan = planned()
    made = FAMILY.make(the_device(plan), Cell(plan.cell), None)  # type: ignore[arg-type]
    assert isinstance(made, CanopenDeviceLink)
    assert made.health().figures["state"] == "starting"


async def test_object_is_asked_by_hand_beside_the_manager(channel: str) -> None:
    plan = planned(channel=channel)
    link = link_of(plan, FakeRobot(plan).cell)
    with pytest.raises(AccessError, match="device encoder is not asked"):
        await link.ask(PlaceRequest("0x6004"))
    async with an_encoder(channel) as encoder, managed([link]):
        await until(lambda: link.health().figures["state"] == "good")
        assert (await link.ask(PlaceRequest("0x6004"))).values[0].value == 1500
        answer = await link.ask(PlaceRequest("0x1014", value="0x85"))
        assert (answer.values[0].value, encoder.get(0x1014)) == (0x85, 0x85)
        with pytest.raises(AccessError, match="gatewayd force clamp VALUE"):
            await link.ask(PlaceRequest("0x6200:1", value="1"))
        assert link.health().figures["state"] == "good"
