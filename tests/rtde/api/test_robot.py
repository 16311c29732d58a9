"""A robot at a simulated controller, over a real socket."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.simulator.faults import DropAt, FaultStep
from gatewayd.simulator.server import SimulatedController

Connect = Callable[..., rtde.Robot]
PATIENCE = 10.0


async def samples(robot: rtde.Robot, count: int) -> list[rtde.Sample]:
    async with asyncio.timeout(PATIENCE):
        found = []
        async for sample in robot:
            found.append(sample)
            if len(found) == count:
                break
    return found


async def event(robot: rtde.Robot, kind: type[Any]) -> Any:
    async with asyncio.timeout(PATIENCE):
        async for found in robot.events:
            if isinstance(found, kind):
                return found
    raise AssertionError(kind)


async def test_every_package_comes_in_its_order(connect: Connect) -> None:
    """Also those that came together, while the loop stood still."""
    async with connect(outputs=["actual_q", "robot_mode"]) as robot:
        found = await samples(robot, 10)
        for _ in range(5):
            until = asyncio.get_running_loop().time() + 0.1
            while asyncio.get_running_loop().time() < until:
                pass
            found += await samples(robot, 3)
        await robot.pause()
        found += robot.samples.take()
        assert len(found) == robot.statistics.packages
    times = [sample.timestamp for sample in found]
    assert times == sorted(set(times))
    assert len(found[0].actual_q) == 6
    assert found[0].names == ("actual_q", "robot_mode")
    assert found[0].values == (*found[0].actual_q, found[0].robot_mode)


async def test_what_was_agreed_can_be_read(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(outputs=["actual_q"], inputs={"a": ["input_int_register_0"]}, frequency=100) as robot:
        assert str(robot.version) == "5.26.0.0"
        assert robot.series is not None
        assert robot.series.word == "e"
        assert (robot.protocol, robot.max_frequency, robot.frequency) == (2, 500.0, 100.0)
        assert robot.outputs.names == ("actual_q",)
        assert robot.outputs_id == 1
        assert (robot.inputs["a"].id, robot.inputs["a"].recipe.names) == (1, ("input_int_register_0",))
        assert robot.peer_address == ("127.0.0.1", simulator.port)
        assert robot.own_address is not None
        assert robot.own_address[0] == "127.0.0.1"
        assert robot.state is rtde.ConnectionState.RUNNING
        assert robot.unavailable == ()


async def test_newer_passes_over_what_is_older(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"]) as robot:
        first = await robot.newer(PATIENCE)
        second = await robot.newer(PATIENCE)
        assert second.timestamp > first.timestamp
        await robot.pause()
        if robot.latest is not second:
            assert await robot.newer() is robot.latest
        with pytest.raises(TimeoutError):
            await robot.newer(0.01)


async def test_a_refused_field_is_named_with_its_likely_holder(
    connect: Connect, simulator: SimulatedController
) -> None:
    simulator.controller.hold(["input_int_register_3"])
    wishes: dict[str, Any] = {
        "outputs": ["no_such_field"],
        "inputs": {"in": ["input_int_register_2", "input_int_register_3"]},
    }
    with pytest.raises(rtde.FieldsRefusedError, match="no_such_field: NOT_FOUND") as refusal:
        await connect(**wishes).open()
    assert [(each.field, each.word) for each in refusal.value.fields] == [
        ("no_such_field", "NOT_FOUND"),
        ("input_int_register_3", "IN_USE"),
    ]
    assert "PROFINET" in str(refusal.value)
    async with connect(**wishes, strict=False) as robot:
        assert {each.field for each in robot.unavailable} == {"no_such_field", "input_int_register_3"}
        await robot.write("in", input_int_register_2=5, verify=True)
        with pytest.raises(rtde.WriteRefusedError, match="IN_USE, probably claimed by"):
            await robot.write("in", input_int_register_3=5)
        simulator.controller.free(["input_int_register_3"])
        async with asyncio.timeout(PATIENCE):
            while robot.unavailable != () and [each.field for each in robot.unavailable] != ["no_such_field"]:
                await robot.newer()
        await robot.write("in", input_int_register_3=6, verify=True)
        assert robot.known("in") == {"input_int_register_2": 5, "input_int_register_3": 6}


async def test_strict_waits_for_an_input_in_use(connect: Connect, simulator: SimulatedController) -> None:
    simulator.controller.hold(["input_int_register_3"])
    robot = connect(inputs={"in": ["input_int_register_3"]}, claim_timeout=PATIENCE)
    opening = asyncio.create_task(robot.open())
    await event(robot, rtde.RefusedEvent)
    simulator.controller.free(["input_int_register_3"])
    await opening
    await robot.write("in", input_int_register_3=1, verify=True)
    await robot.close()


async def test_declared_types_are_compared(connect: Connect) -> None:
    declared = {"actual_q": "VECTOR6D", "robot_mode": "UINT32"}
    with pytest.raises(
        rtde.TypesDifferError, match="robot_mode was declared as UINT32, the controller has INT32"
    ):
        await connect(outputs=declared).open()
    async with connect(outputs={"actual_q": "VECTOR6D", "robot_mode": None}) as robot:
        assert robot.outputs.names == ("actual_q", "robot_mode")


async def test_protocol_1_can_be_forced_and_is_the_only_one_of_old_controllers(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(outputs=["robot_mode"], protocol=1) as robot:
        assert (robot.protocol, robot.outputs_id, robot.frequency) == (1, None, 125.0)
        await samples(robot, 3)
    simulator.faults.v1_only = True
    with pytest.raises(rtde.ConnectFailedError, match="does not speak protocol version 2, which was forced"):
        await connect(outputs=["robot_mode"], protocol=2).open()
    async with connect(outputs=["robot_mode"], inputs={"in": ["input_int_register_0"]}) as robot:
        assert robot.protocol == 1
        await robot.write("in", input_int_register_0=4, verify=True)


async def test_a_reconnect_repeats_no_write_and_says_so(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(outputs=["robot_mode"], inputs={"in": ["input_int_register_0"]}) as robot:
        await robot.write("in", input_int_register_0=4, verify=True)
        simulator.controller.set("input_int_register_0", (0,))
        simulator.faults.drop_at = DropAt(FaultStep.WRITE, 2)
        with pytest.raises(rtde.ConnectionLostError, match="lost before 'in' was verified"):
            await robot.write("in", input_int_register_0=9, verify=True, timeout=PATIENCE)
        lost = await event(robot, rtde.LostEvent)
        assert not lost.final
        await event(robot, rtde.StartedEvent)
        assert simulator.controller.get("input_int_register_0") == (0,)
        await robot.newer(PATIENCE)
        assert robot.known("in") == {"input_int_register_0": 0}
        assert robot.statistics.sessions == 2


async def test_without_a_connection_a_write_fails_at_once(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect(outputs=["robot_mode"], inputs={"in": ["input_int_register_0"]}) as robot:
        await simulator.stop()
        await event(robot, rtde.LostEvent)
        with pytest.raises(rtde.ConnectionLostError, match="not connected"):
            await robot.write("in", input_int_register_0=9)
        assert robot.latest is None
        await simulator.start()
        await event(robot, rtde.StartedEvent)
        assert simulator.controller.get("input_int_register_0") == (0,)


async def test_iterators_go_on_over_a_reconnect(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"]) as robot:
        before = (await samples(robot, 3))[-1].timestamp
        await robot.reconnect(PATIENCE)
        after = await samples(robot, 1)
        assert after[0].timestamp > before


async def test_limits_end_the_attempts(connect: Connect, simulator: SimulatedController) -> None:
    await simulator.stop()
    with pytest.raises(rtde.ConnectFailedError, match="connection refused") as failure:
        await connect(retry=rtde.Retry(connect_attempts=3, delay=0.001)).open()
    assert failure.value.loss is not None
    assert failure.value.loss.attempts == 3
    await simulator.start()
    simulator.faults.drop_at, simulator.faults.drop_times = DropAt(FaultStep.OUTPUTS), 2
    with pytest.raises(rtde.ConnectFailedError):
        await connect(retry=rtde.Retry(setup_attempts=2, delay=0.001)).open()
    async with connect() as robot:
        assert robot.connected


async def test_by_hand_nothing_is_reconnected(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(outputs=["robot_mode"], reconnect=None) as robot:
        await samples(robot, 1)
        await simulator.restart()
        assert (await event(robot, rtde.LostEvent)).final
        with pytest.raises(rtde.ConnectionLostError):
            await samples(robot, 1000)
        with pytest.raises(rtde.ConnectionLostError):
            await robot.newer()
        assert robot.state is rtde.ConnectionState.LOST
        await robot.reconnect(PATIENCE)
        await samples(robot, 3)


async def test_pausing_changing_and_going_on(connect: Connect) -> None:
    async with connect(
        outputs=["robot_mode"], inputs={"a": ["input_int_register_0"], "b": ["input_int_register_1"]}
    ) as robot:
        with pytest.raises(rtde.RtdeError, match="paused"):
            await robot.set_up(outputs=["actual_q"])
        await robot.pause()
        assert robot.state is rtde.ConnectionState.PAUSED
        await robot.set_up(
            outputs=["actual_q"],
            inputs={"b": ["input_int_register_1"], "c": ["input_int_register_2"]},
            frequency=50,
        )
        assert robot.state is rtde.ConnectionState.PAUSED
        assert {key: held.id for key, held in robot.inputs.items()} == {"b": 2, "c": 3}
        robot.events.take()
        await robot.resume()
        sample = await robot.newer(PATIENCE)
        assert (sample.names, robot.frequency) == (("actual_q",), 50.0)
        await robot.write("c", input_int_register_2=3, verify=True)
        with pytest.raises(ValueError, match="no input recipe is called 'a'"):
            await robot.write("a", input_int_register_0=1)
        assert robot.statistics.sessions == 1


async def test_a_robot_opened_paused_starts_on_request(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"], start=False) as robot:
        assert robot.state is rtde.ConnectionState.PAUSED
        with pytest.raises(TimeoutError):
            await robot.newer(0.05)
        await robot.resume()
        await samples(robot, 2)


async def test_the_boot_is_waited_for(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"], boot_wait=True) as robot:
        assert robot.latest is not None
        assert robot.latest.timestamp >= 40
        with pytest.raises(TimeoutError):
            await robot.booted(timeout=0.01, uptime=1e6)


async def test_texts_come_as_events_and_go_to_the_log(
    connect: Connect, simulator: SimulatedController, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    simulator.faults.text_on_connect = "SafetySetup has not been confirmed yet"
    async with connect(outputs=["robot_mode"]) as robot:
        text = await event(robot, rtde.TextEvent)
        assert text.message == "SafetySetup has not been confirmed yet"
        assert robot.last_text is not None
        await robot.message("cycle done", rtde.TextLevel.WARNING, source="cell 4")
        with pytest.raises(ValueError, match="256 bytes"):
            await robot.message("x" * 256)
        await robot.reconnect(PATIENCE)
    assert "(level 2) cell 4: cycle done" in caplog.text


async def test_properties_are_told_by_new_controllers(connect: Connect) -> None:
    async with connect() as robot:
        found = await robot.properties()
        assert found.answered
        assert found["v1.software.version"] == 5 << 48 | 26 << 32
        some = await robot.properties(["v1.control_box.type", "v2.unknown"])
        assert dict(some.missing) == {"v2.unknown": "NOT_FOUND"}
        assert list(some) == ["v1.control_box.type"]


async def test_a_robot_cannot_be_opened_twice(connect: Connect) -> None:
    robot = connect()
    async with robot:
        with pytest.raises(rtde.RtdeError, match="opened before"):
            await robot.open()
    await robot.close()
    with pytest.raises(rtde.RtdeError, match="closed"):
        robot.stream()


async def test_closing_ends_iterators(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"]) as robot:
        reading = asyncio.create_task(anext(aiter(robot.stream())))
        await reading
        events = robot.events
    assert [sample async for sample in robot][-1:] is not None
    assert [each async for each in events]


async def test_a_slow_reader_is_told_what_it_lost(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"]) as robot:
        stream = robot.stream(buffer=5)
        await stream.next(PATIENCE)
        while stream.overflowed < 5:
            await robot.newer(PATIENCE)
        lost = stream.overflowed
        found = stream.take()
        assert len(found) == 5
        overflow = [each for each in robot.events.take() if isinstance(each, rtde.OverflowEvent)]
        assert (overflow[0].lost, overflow[-1].lost, overflow[-1].total) == (1, lost, lost)


@pytest.mark.parametrize(
    "wishes, problem",
    [
        ({"protocol": 3}, "versions 1 and 2"),
        ({"frequency": -1.0}, "frequency"),
        ({"outputs": ["a", "a"]}, "twice"),
        ({"inputs": {"in": []}}, "no field"),
        ({"outputs": {"actual_q": "VECTOR"}}, "none of BOOL"),
        ({"boot_wait": True, "start": False}, "boot_wait"),
    ],
)
def test_arguments_that_cannot_be_meant_are_refused(wishes: dict[str, Any], problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        rtde.connect("127.0.0.1", **wishes)


async def test_cancelling_while_it_connects_leaves_no_connection(connect: Connect) -> None:
    """Also where the connection has just come about: it would set itself up, and hold its claims for ever."""
    wishes = {"inputs": {"a": ["input_int_register_0"]}}
    for steps in range(40):
        robot = connect(**wishes)
        opening = asyncio.ensure_future(robot.open())
        for _ in range(steps):
            await asyncio.sleep(0)
        opening.cancel()
        await asyncio.wait((opening,))
        if not opening.cancelled():
            await robot.close()
    async with asyncio.timeout(PATIENCE), connect(**wishes, claim_timeout=PATIENCE) as robot:
        assert robot.unavailable == ()


@pytest.mark.parametrize(
    "wishes, words",
    [
        ({"port": 0}, "port 0: TCP has 1 to 65535"),
        ({"port": 70000}, "port 70000"),
        ({"buffer": -1}, "a buffer of -1 samples"),
        ({"data_timeout": 0}, "a timeout of 0 s"),
        ({"connect_timeout": math.nan}, "a timeout of nan s"),
    ],
)
def test_numbers_that_cannot_be_meant_are_refused(wishes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        rtde.connect("127.0.0.1", **wishes)
