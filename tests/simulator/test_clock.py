"""The clock of a simulator: scaled or stepped, and all that takes time counts by it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde.messages import (
    ControllerVersion,
    GetControllerVersion,
    ProtocolVersionReply,
    RequestProtocolVersion,
)
from gatewayd.simulator.clock import ScaledClock, SteppedClock
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import Faults
from gatewayd.simulator.server import SimulatedController

if TYPE_CHECKING:
    from tests.simulator.conftest import Client

INT = "input_int_register_0"


def test_a_stepped_clock_calls_what_is_due_in_its_order() -> None:
    clock = SteppedClock(500)
    called: list[str] = []
    clock.call_at(0.004, lambda: called.append("second"))
    clock.call_at(0.002, lambda: called.append("first"))
    clock.call_at(0.004, lambda: called.append("third"))
    clock.call_at(0.004, lambda: called.append("never")).cancel()
    seen = []
    for _ in range(3):
        clock.step()
        seen.append((round(clock.now, 6), called.copy()))
    assert seen == [(0.002, ["first"]), (0.004, called), (0.006, called)]
    assert called == ["first", "second", "third"]


def test_what_is_due_already_is_called_in_the_next_step() -> None:
    """Also what is added by a call, and what is due at a sum of periods that is not exact."""
    clock = SteppedClock(125)
    called: list[float] = []
    clock.call_at(-1, lambda: clock.call_at(0.0, lambda: called.append(clock.now)))
    clock.call_at(sum([0.008] * 7), lambda: called.append(clock.now))
    for _ in range(7):
        clock.step()
    assert called == [0.008, pytest.approx(0.056)]


@pytest.mark.parametrize("speed", [0.5, 1.0, 50.0])
async def test_a_scaled_clock_is_that_much_faster(speed: float) -> None:
    clock, loop = ScaledClock(speed), asyncio.get_running_loop()
    before, start, after = loop.time(), clock.now, loop.time()
    done = asyncio.Event()
    clock.call_at(start + 0.01 * speed, done.set)
    await done.wait()
    least, passed, most = loop.time() - after, clock.now - start, loop.time() - before
    assert passed >= 0.0099 * speed
    assert least * speed <= passed <= most * speed


def stepped(faults: Faults | None = None) -> SimulatedController:
    return SimulatedController(Controller(faults=faults), stepped=True)


async def test_what_is_delayed_leaves_in_the_step_in_which_it_is_due(client: type[Client]) -> None:
    """The same packages in the same steps each time; answers too."""
    async with stepped() as robot, client(robot.port) as one, client(robot.port) as other:
        await one.stream("timestamp")
        robot.faults.delay = 0.006
        await robot.step(3)
        other.send(GetControllerVersion())
        stamps = []
        for _ in range(6):
            await robot.step()
            stamps.append(round(float((await one.package())[0]) * 500) - 50000)
        assert stamps == [1, 2, 3, 4, 5, 6], "three steps later than they were made"
        await robot.step(4)
        await other.receive(ControllerVersion)


async def test_a_pause_takes_its_steps(client: type[Client]) -> None:
    """Nothing is sent, counted or answered, and the timestamp goes on where it stopped."""
    async with stepped() as robot, client(robot.port) as one, client(robot.port) as other:
        await one.stream("timestamp")
        await robot.step()
        robot.pause(0.02)
        other.send(RequestProtocolVersion(2))
        await robot.step(9)
        assert (robot.paused, robot.controller.cycle) == (True, 1)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.01):
                await other.receive(ProtocolVersionReply)
        await robot.step(1)
        assert (robot.paused, robot.controller.cycle) == (False, 1), "ten cycles of the clock have passed"
        await robot.step(3)
        assert robot.controller.cycle == 4
        await other.receive(ProtocolVersionReply)
        stamps = [round(float((await one.package())[0]) * 500) - 50000 for _ in range(4)]
        assert stamps == [1, 2, 3, 4]


async def test_claims_linger_for_steps(client: type[Client]) -> None:
    async with stepped(Faults(linger=0.01)) as robot, client(robot.port) as other:
        async with client(robot.port) as one:
            await one.inputs(INT)
        async with asyncio.timeout(5):
            while robot.clients > 1:  # noqa: ASYNC110
                await asyncio.sleep(0)
        await robot.step(4)
        assert (await other.inputs(INT)).types == ("IN_USE",)
        await robot.step(1)
        assert (await other.inputs(INT)).recipe == 1


async def test_a_raised_speed_shortens_delay_and_pause(client: type[Client]) -> None:
    """A second each, at fifty times the clock's speed."""
    loop = asyncio.get_running_loop()
    async with SimulatedController(speed=50) as robot, client(robot.port) as one:
        robot.faults.delay = 1.0
        begun = loop.time()
        one.send(GetControllerVersion())
        await one.receive(ControllerVersion)
        assert 0.019 < loop.time() - begun < 0.9
        robot.faults.delay = 0.0
        robot.pause(1.0)
        begun = loop.time()
        one.send(GetControllerVersion())
        await one.receive(ControllerVersion)
        assert 0.019 < loop.time() - begun < 0.9


async def test_a_raised_speed_shortens_lingering(client: type[Client]) -> None:
    faults = Faults(linger=1.0)
    async with (
        SimulatedController(Controller(faults=faults), speed=50) as robot,
        client(robot.port) as other,
        asyncio.timeout(0.9),
    ):
        async with client(robot.port) as one:
            await one.inputs(INT)
        while (await other.inputs(INT)).types == ("IN_USE",):
            pass
