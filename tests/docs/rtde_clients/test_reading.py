"""Samples: the newest, every one, their values, and what was lost."""

from __future__ import annotations

import asyncio
import copy
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde import sync
from gatewayd.simulator.double import SimulatedRobot
from gatewayd.simulator.server import SimulatedController
from tests.docs.rtde_clients.conftest import PATIENCE, Connect


async def test_newer_waits_for_the_newest(connect: Connect, simulator: SimulatedController) -> None:
    """Older ones are passed over; the time it waits is limited, and the limit ends in TimeoutError."""
    async with connect(outputs=["output_int_register_0"]) as robot:
        first = await robot.newer(PATIENCE)
        while robot.statistics.packages < 5:
            await robot.newer(PATIENCE)
        second = robot.latest
        simulator.set("output_int_register_0", 3)
        while (third := await robot.newer(PATIENCE)).output_int_register_0 != 3:
            pass
        assert second is not None
        assert first.timestamp < second.timestamp < third.timestamp
        await robot.pause()
        if robot.latest is not third:
            await robot.newer()
        with pytest.raises(TimeoutError):
            await robot.newer(0.01)


async def test_latest_is_there_without_waiting(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"], start=False) as robot:
        found = [robot.latest]
        await robot.resume()
        sample = await robot.newer(PATIENCE)
        found.append(robot.latest)
        assert found == [None, sample]
        assert sample.robot_mode == 7


async def test_every_package_comes_once_and_in_order(connect: Connect) -> None:
    """By `async for`, while the packages are read whenever the loop runs: no thread has to be started."""
    async with connect(outputs=["robot_mode"]) as robot:
        found = []
        async for sample in robot:
            found.append(sample.timestamp)
            if len(found) == 10:
                break
        await robot.pause()
        found += [sample.timestamp for sample in robot.samples.take()]
        assert len(found) == robot.statistics.packages
    assert found == sorted(set(found))


def test_every_package_comes_without_asyncio(robot: SimulatedRobot) -> None:
    with sync.connect(robot.host, port=robot.port, outputs=["robot_mode"]) as connected:
        times = [sample.timestamp for sample, _ in zip(connected, range(10), strict=False)]
    assert times == sorted(set(times))


async def test_take_gives_what_is_there_without_waiting(connect: Connect) -> None:
    """A stream of one's own, whose `len` says whether something has come."""
    async with connect(outputs=["robot_mode"]) as robot:
        await robot.newer(PATIENCE)
        stream = robot.stream()
        await robot.newer(PATIENCE)
        await robot.pause()
        waiting = len(stream)
        assert waiting > 0
        assert len(stream.take()) == waiting
        assert stream.take() == []
        stream.close()


async def test_what_the_buffer_cannot_hold_is_counted_and_reported(connect: Connect) -> None:
    """`buffer` is in packages; the oldest are lost."""
    async with connect(outputs=["robot_mode"], buffer=3) as robot:
        await robot.samples.next(PATIENCE)
        while robot.overflowed < 4:
            await robot.newer(PATIENCE)
        await robot.pause()
        lost = robot.overflowed
        left = robot.samples.take()
        assert len(left) == 3
        assert left[-1] is robot.latest
        assert robot.statistics.packages == 1 + lost + 3
        overflow = [each for each in robot.events.take() if isinstance(each, rtde.OverflowEvent)]
        assert (overflow[-1].lost, overflow[-1].total) == (lost, lost)


async def test_what_the_controller_skipped_is_counted_too(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(outputs=["robot_mode"]) as robot:
        await robot.newer(PATIENCE)
        before = robot.statistics.skipped
        simulator.controller.advance(4)
        async with asyncio.timeout(PATIENCE):
            while robot.statistics.skipped < before + 4:
                await robot.newer()


async def test_a_field_is_an_attribute_or_an_item(connect: Connect, simulator: SimulatedController) -> None:
    """A number for a scalar, a tuple of numbers for a vector."""
    simulator.set("payload_cog", 0.25, 0.5, 0.75)
    simulator.set("actual_digital_output_bits", 2**40)
    outputs = ["payload_cog", "actual_digital_output_bits", "robot_mode", "joint_mode"]
    async with connect(outputs=outputs) as robot:
        sample = await robot.newer(PATIENCE)
    assert isinstance(sample, rtde.Sample)
    assert sample.payload_cog == sample["payload_cog"] == (0.25, 0.5, 0.75)
    assert sample.payload_cog[1] == 0.5
    assert sample.actual_digital_output_bits == 2**40
    assert sample.joint_mode == (253,) * 6
    assert ("robot_mode" in sample, "actual_q" in sample) == (True, False)


async def test_the_timestamp_is_always_there(connect: Connect) -> None:
    """Also where it was not asked for, and then it is no part of `values`."""
    async with connect(outputs=["robot_mode"]) as robot:
        sample = await robot.newer(PATIENCE)
        assert sample.timestamp >= 100
        assert (sample.names, sample.values) == (("robot_mode",), (7,))


async def test_values_are_flat_and_as_dict_has_names(connect: Connect) -> None:
    async with connect(outputs=["actual_q", "robot_mode"]) as robot:
        sample = await robot.newer(PATIENCE)
        values: tuple[Any, ...] = sample.values
        assert values == (*sample.actual_q, 7)
        picked: Any = values[robot.outputs.slots["actual_q"]]
        assert picked == sample.actual_q
    assert sample.as_dict() == {"actual_q": sample.actual_q, "robot_mode": 7}
    assert str(sample).startswith("<Sample actual_q=(")
    assert "robot_mode=7" in str(sample)


async def test_a_sample_never_changes(connect: Connect) -> None:
    """So nobody has to copy it: neither a later package nor the program gives it other values."""
    async with connect(outputs=["actual_q"]) as robot:
        sample: Any = await robot.newer(PATIENCE)
        before = copy.copy(sample.as_dict())
        for _ in range(3):
            await robot.newer(PATIENCE)
        with pytest.raises(AttributeError):
            sample.actual_q = (0.0,) * 6
        with pytest.raises(TypeError):
            sample["actual_q"] = (0.0,) * 6
    assert sample.as_dict() == before


async def test_bits_are_tested_in_their_number(connect: Connect, simulator: SimulatedController) -> None:
    simulator.set("output_bit_registers0_to_31", 0b101)
    async with connect(outputs=["robot_status_bits", "output_bit_registers0_to_31"]) as robot:
        sample = await robot.newer(PATIENCE)
    assert sample.robot_status_bits & 1 == 1, "power on"
    assert [sample.output_bit_registers0_to_31 >> bit & 1 for bit in range(3)] == [1, 0, 1]


async def test_the_types_are_the_controllers(connect: Connect) -> None:
    async with connect(outputs=["robot_mode", "joint_mode"], inputs={"in": ["speed_slider_mask"]}) as robot:
        assert {name: kind.word for name, kind in robot.outputs.kinds.items()} == {
            "robot_mode": "INT32",
            "joint_mode": "VECTOR6INT32",
        }
        assert robot.inputs["in"].recipe.kinds["speed_slider_mask"].word == "UINT32"
        assert robot.outputs.names == ("robot_mode", "joint_mode")


@pytest.mark.parametrize("protocol, number", [(1, None), (2, 1)])
async def test_the_output_recipe_has_an_id_in_protocol_2(
    connect: Connect, protocol: int, number: int | None
) -> None:
    async with connect(outputs=["robot_mode"], protocol=protocol) as robot:
        assert robot.outputs_id == number


async def test_properties_are_read_by_name(connect: Connect) -> None:
    async with connect() as robot:
        found = await robot.properties()
        assert list(found) == [
            "v1.software.version",
            "v1.control_box.type",
            "v1.robot_arm.tool_flange.type",
        ]
        assert found["v1.software.version"] >> 48 == 5  # type: ignore[operator]
        assert isinstance(found["v1.control_box.type"], int)
        some = await robot.properties(["v1.control_box.type", "v1.nothing"])
        assert (list(some), dict(some.missing)) == (["v1.control_box.type"], {"v1.nothing": "NOT_FOUND"})
        with pytest.raises(KeyError, match=r"v1\.nothing: NOT_FOUND"):
            _ = some["v1.nothing"]
