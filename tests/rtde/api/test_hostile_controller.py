"""A robot at a controller that misbehaves: what a program sees is a loss, an event or an error, and nothing else."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde import messages
from gatewayd.rtde.loss import LossReason
from tests.rtde.conftest import Controller

PATIENCE = 10.0
INPUTS = {"in": ["input_int_register_0", "input_int_register_1"]}


def robot_at(controller: Controller, **wishes: Any) -> rtde.Robot:
    return rtde.connect("127.0.0.1", port=controller.port, outputs=["robot_mode"], **wishes)


async def drain(robot: rtde.Robot) -> None:
    async with asyncio.timeout(PATIENCE):
        async for _ in robot:
            pass


async def test_a_text_before_every_answer_harms_nothing(controller: Controller) -> None:
    """As PolyScope X sends at connect, in the layout of version 1, and later in that of version 2."""
    controller.script.texts = True
    async with robot_at(controller, inputs=INPUTS) as robot:
        await robot.write("in", input_int_register_0=3, verify=True)
        texts = [event for event in robot.events.take() if isinstance(event, rtde.TextEvent)]
    assert len(texts) >= 5
    assert {text.source for text in texts} == {"", "URControl"}
    assert robot.last_text == messages.TextMessage(texts[-1].message, texts[-1].source, 2)


async def test_a_burst_in_one_segment_is_read_to_its_end(
    controller: Controller, until: Callable[..., Awaitable[None]]
) -> None:
    controller.script.sends_data = False
    async with robot_at(controller) as robot:
        for _ in range(1000):
            controller.peer.package()
        await until(lambda: robot.statistics.packages == 1000)
        found = robot.samples.take()
    assert [round(sample.timestamp * 500) - 50000 for sample in found] == list(range(1, 1001))


async def test_bytes_that_are_no_package_end_the_session_and_the_next_one_works(
    controller: Controller,
) -> None:
    async with robot_at(controller) as robot:
        await robot.newer(PATIENCE)
        controller.peer.writer.write(b"\0\0\0")
        async with asyncio.timeout(PATIENCE):
            async for event in robot.events:
                if isinstance(event, rtde.LostEvent):
                    break
        assert "not RTDE" in str(event)
        await robot.newer(PATIENCE)
        assert robot.statistics.sessions == 2


async def test_an_odd_package_is_an_event(controller: Controller) -> None:
    async with robot_at(controller) as robot:
        controller.peer.writer.write(b"\x00\x04\x63\x00")
        async with asyncio.timeout(PATIENCE):
            async for event in robot.events:
                if isinstance(event, rtde.ErrorEvent):
                    break
        assert str(event) == "odd package: unknown package type 99: 00 04 63 00"
        assert robot.statistics.sessions == 1


@pytest.mark.parametrize(
    "reply",
    [b"", b"\0", b"\0\xff", b"\0\x06UINT64", b"\0\x04BOOL" * 9],
    ids=lambda reply: reply.hex() or "empty",
)
async def test_no_answer_about_properties_harms_the_robot(controller: Controller, reply: bytes) -> None:
    async with robot_at(controller) as robot:
        asking = asyncio.create_task(robot.properties(["a", "b"], timeout=0.2))
        await asyncio.sleep(0)
        controller.peer.writer.write(bytes((0, 3 + len(reply))) + b"\x52" + reply)
        assert not (await asking).answered
        await robot.newer(PATIENCE)
        assert robot.statistics.sessions == 1


async def test_properties_that_are_too_short_are_an_error_and_no_loss(controller: Controller) -> None:
    async with robot_at(controller) as robot:
        asking = asyncio.create_task(robot.properties(["a", "b"]))
        await asyncio.sleep(0)
        controller.peer.writer.write(b"\0\x11\x52\0\x0bBOOL,UINT64\1")
        with pytest.raises(rtde.RtdeError, match="properties with 1 byte of values, 9 expected"):
            await asking
        await robot.newer(PATIENCE)
        assert robot.statistics.sessions == 1


async def test_a_controller_that_is_silent_in_the_set_up_costs_one_attempt(controller: Controller) -> None:
    controller.script.mute = {messages.SetupInputs}
    with pytest.raises(rtde.ConnectFailedError, match="answer to an input recipe did not arrive within"):
        await robot_at(controller, inputs=INPUTS, handshake_timeout=0.05).open()


async def test_a_controller_that_does_not_read_is_given_up(controller: Controller) -> None:
    controller.script.stop_reading = True
    controller.script.mute = {messages.DataPackage}
    robot = robot_at(controller, inputs=INPUTS, reconnect=None)
    controller.script.stop_reading = False
    async with robot:
        await robot.newer(PATIENCE)
        controller.script.stop_reading = True
        with pytest.raises(rtde.ConnectionLostError):  # noqa: PT012  as often as it takes
            while True:
                for _ in range(1000):
                    await robot.write("in", input_int_register_0=1, input_int_register_1=2)
                await asyncio.sleep(0)
        with pytest.raises(rtde.ConnectionLostError):
            await drain(robot)
        assert robot.last_loss is not None
        assert robot.last_loss.reason in {LossReason.CONGESTED, LossReason.SILENT}


async def test_spoiled_answers_are_lost_sessions_or_errors_of_the_api(controller: Controller) -> None:
    rng = random.Random(12)

    def spoil(package: bytes) -> bytes:
        if rng.random() >= controller.script.spoiled:
            return package
        data = bytearray(package)
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return bytes(data[: rng.randint(1, len(data))]) if rng.random() < 0.3 else bytes(data)

    controller.script.spoil, controller.script.spoiled = spoil, 0.1
    quick = rtde.Retry(delay=0.001, max_delay=0.001)
    wishes: dict[str, Any] = {
        "handshake_timeout": 0.02,
        "data_timeout": 0.05,
        "retry": quick,
        "reconnect": quick,
    }
    robot = robot_at(controller, inputs=INPUTS, strict=False, **wishes)
    async with asyncio.timeout(60), robot:
        while robot.statistics.sessions < 20:
            try:
                await robot.write("in", input_int_register_0=1, verify=True, timeout=0.02)
            except (rtde.RtdeError, TimeoutError):
                await asyncio.sleep(0.001)
        controller.script.spoiled = 0.0
        while True:
            try:
                await robot.newer(1)
                await robot.write("in", input_int_register_0=1, input_int_register_1=2, verify=True)
            except (rtde.RtdeError, TimeoutError):
                await asyncio.sleep(0.001)
            else:
                break
