"""What happens, as values of `robot.events`: each comes from a controller over a real socket."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde.codec import ControllerProtocol
from gatewayd.rtde.messages import TextMessage
from gatewayd.simulator.server import SimulatedController
from tests.docs.rtde_clients.conftest import PATIENCE, Connect, event, until

Cause = Callable[[rtde.Robot, SimulatedController], Awaitable[None]]
IN = {"in": ["input_int_register_24"]}


async def nothing(_robot: rtde.Robot, _simulator: SimulatedController) -> None:
    """It comes by itself."""


async def pause(robot: rtde.Robot, _simulator: SimulatedController) -> None:
    await robot.pause()


async def resume(robot: rtde.Robot, _simulator: SimulatedController) -> None:
    await robot.pause()
    robot.events.take()
    await robot.resume()


async def drop(_robot: rtde.Robot, simulator: SimulatedController) -> None:
    simulator.drop_clients()


async def say(_robot: rtde.Robot, simulator: SimulatedController) -> None:
    simulator.say("the gripper is open")


async def send_nonsense(_robot: rtde.Robot, simulator: SimulatedController) -> None:
    simulator.raw(b"\x00\x04\x63\x00")


@pytest.mark.parametrize(
    "name, happens, text",
    [
        pytest.param("ConnectedEvent", nothing, "connected to 127.0.0.1:", id="ConnectedEvent"),
        pytest.param("SetUpEvent", nothing, "5.26", id="SetUpEvent"),
        pytest.param("RefusedEvent", nothing, "not available: no_such_field (NOT_FOUND", id="RefusedEvent"),
        pytest.param("StartedEvent", nothing, "started", id="StartedEvent"),
        pytest.param("StartedEvent", resume, "started", id="StartedEvent after resume"),
        pytest.param("PausedEvent", pause, "paused", id="PausedEvent"),
        pytest.param("LostEvent", drop, "lost: ", id="LostEvent"),
        pytest.param("TextEvent", say, "warning", id="TextEvent"),
        pytest.param("ErrorEvent", send_nonsense, "odd package: unknown package type 99", id="ErrorEvent"),
    ],
)
async def test_it_comes_when_it_happens(
    connect: Connect, simulator: SimulatedController, name: str, happens: Cause, text: str
) -> None:
    robot = connect(outputs=["robot_mode", "no_such_field"], inputs=IN, strict=False)
    async with robot:
        if happens is not nothing:
            robot.events.take()
        await happens(robot, simulator)
        assert text in str(await event(robot, getattr(rtde, name)))


async def test_a_set_up_has_what_was_agreed(connect: Connect) -> None:
    """The answers to version, output and input requests together: SetUpEvent, with the whole session."""
    async with connect(outputs=["robot_mode"], inputs=IN, protocol=2) as robot:
        session = (await event(robot, rtde.SetUpEvent)).session
        assert (session.protocol, str(session.controller)) == (2, "5.26.0.0")
        assert session.outputs.kinds["robot_mode"].word == "INT32"
        assert session.inputs["in"].recipe.names == ("input_int_register_24",)
        assert session.inputs["in"].id == 1


@pytest.mark.parametrize(
    "wishes, field, word",
    [
        ({"inputs": IN}, "input_int_register_24", "IN_USE"),
        ({"outputs": ["actual_p"]}, "actual_p", "NOT_FOUND"),
    ],
    ids=["inputs", "outputs"],
)
async def test_what_was_refused_is_in_refused_event(
    connect: Connect, simulator: SimulatedController, wishes: dict[str, Any], field: str, word: str
) -> None:
    simulator.controller.hold(["input_int_register_24"], "another client")
    async with connect(**wishes, strict=False) as robot:
        refused = await event(robot, rtde.RefusedEvent)
        assert [(each.field, each.word) for each in refused.fields] == [(field, word)]


async def test_they_come_in_their_order(connect: Connect) -> None:
    """And `async for` ends when the robot is closed."""
    async with connect(outputs=["robot_mode"]) as robot:
        await robot.newer(PATIENCE)
        await robot.pause()
        await robot.resume()
        await robot.newer(PATIENCE)
    kinds = [type(each).__name__ async for each in robot.events]
    assert kinds == ["ConnectedEvent", "SetUpEvent", "StartedEvent", "PausedEvent", "StartedEvent"]


@pytest.mark.parametrize("level", ["EXCEPTION", "ERROR", "WARNING", "INFO"])
async def test_a_text_has_message_source_and_level(
    connect: Connect, simulator: SimulatedController, level: str
) -> None:
    """As an event, and as `last_text`."""
    protocol = ControllerProtocol()
    protocol._speak(2)
    async with connect(outputs=["robot_mode"]) as robot:
        simulator.raw(protocol.send(TextMessage("moved", "URControl", rtde.TextLevel[level])))
        text = await event(robot, rtde.TextEvent)
        assert (text.message, text.source, text.level) == ("moved", "URControl", rtde.TextLevel[level])
        assert robot.last_text == TextMessage("moved", "URControl", rtde.TextLevel[level])


async def test_a_text_of_protocol_1_has_no_source(connect: Connect, simulator: SimulatedController) -> None:
    simulator.faults.v1_only = True
    async with connect(outputs=["robot_mode"]) as robot:
        simulator.say("moved")
        text = await event(robot, rtde.TextEvent)
        assert (text.message, text.source) == ("moved", "")


@pytest.mark.parametrize("level", ["EXCEPTION", "ERROR", "WARNING", "INFO"])
async def test_a_message_goes_to_the_controllers_log(
    connect: Connect, caplog: pytest.LogCaptureFixture, level: str
) -> None:
    """With the source and the level that were given."""
    caplog.set_level("INFO")
    async with connect() as robot:
        await robot.message("cycle done", rtde.TextLevel[level], source="cell 4")
        await robot.properties()  # what is answered behind it
    assert f"(level {rtde.TextLevel[level].value}) cell 4: cycle done" in caplog.text


async def test_any_number_of_texts_may_come_in_the_set_up(
    connect: Connect, simulator: SimulatedController
) -> None:
    """The C++ client tolerates five packages that it does not wait for; here `handshake_timeout` is the limit."""
    waiting = asyncio.create_task(connect(outputs=["robot_mode"], handshake_timeout=PATIENCE).open())
    await until(lambda: simulator.clients)
    for number in range(100):
        simulator.say(f"text {number}")
    await waiting
