"""Connecting, its parameters, what was agreed, states, pausing and reconnecting, as the three clients have them."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from itertools import pairwise
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde import ConnectionState, sync
from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.double import SimulatedRobot
from gatewayd.simulator.faults import DropAt, FaultStep
from gatewayd.simulator.server import SimulatedController
from tests.docs.rtde_clients.conftest import PATIENCE, Connect, event, until

IN = {"in": ["input_int_register_24"]}


async def test_a_connection_is_opened_and_closed_by_async_with(
    connect: Connect, simulator: SimulatedController
) -> None:
    async with connect() as robot:
        assert isinstance(robot, rtde.Robot)
        assert (robot.connected, simulator.clients) == (True, 1)
    await until(lambda: not simulator.clients)
    assert robot.state is ConnectionState.CLOSED


async def test_or_by_open_and_close(connect: Connect, simulator: SimulatedController) -> None:
    robot = connect(outputs=["robot_mode"], inputs=IN)
    await robot.open()
    assert (robot.connected, simulator.clients) == (True, 1)
    await robot.close()
    await robot.close()
    await until(lambda: not simulator.clients)
    async with connect(inputs=IN) as other:
        assert other.unavailable == (), "the claims of the first are given back"


def test_or_without_asyncio(robot: SimulatedRobot) -> None:
    with sync.connect(robot.host, port=robot.port, outputs=["robot_mode"]) as connected:
        assert connected.newer(PATIENCE).robot_mode == 7
        states = [connected.state]
    states.append(connected.state)
    assert states == [ConnectionState.RUNNING, ConnectionState.CLOSED]


async def test_host_and_port_are_those_given(connect: Connect, simulator: SimulatedController) -> None:
    async with connect() as robot:
        assert (robot.host, robot.port) == ("127.0.0.1", simulator.port)
        assert robot.peer_address == (robot.host, robot.port)


async def test_the_own_address_is_the_one_that_the_robot_reaches_us_by(
    connect: Connect, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    async with connect() as robot:
        assert robot.own_address is not None
        host, port = robot.own_address
    assert f"({host}:{port}) connected" in caplog.text


async def test_outputs_are_those_asked_for(connect: Connect) -> None:
    """In their order, with the controller's types; `timestamp` is there besides."""
    async with connect(outputs=["robot_mode", "actual_q"]) as robot:
        assert robot.outputs.names == ("robot_mode", "actual_q")
        assert {name: kind.word for name, kind in robot.outputs.kinds.items()} == {
            "robot_mode": "INT32",
            "actual_q": "VECTOR6D",
        }
        sample = await robot.newer(PATIENCE)
        assert sample.names == ("robot_mode", "actual_q")
        assert sample.timestamp > 0


async def test_registers_are_named_with_their_number(
    connect: Connect, simulator: SimulatedController
) -> None:
    """Recipes are plain lists: they are added to, searched and freed of doubles as any list of Python."""
    simulator.controller.set("output_int_register_10", (17,))
    names = [f"output_int_register_{number}" for number in (9, 10)]
    names += ["output_int_register_11", "output_int_register_10"]
    names.remove("output_int_register_9")
    assert "output_int_register_10" in names
    async with connect(outputs=list(dict.fromkeys(names))) as robot:
        assert robot.outputs.names == ("output_int_register_10", "output_int_register_11")
        assert (await robot.newer(PATIENCE)).output_int_register_10 == 17
    with pytest.raises(ValueError, match="output_int_register_10 is there twice"):
        connect(outputs=names)


async def test_inputs_are_several_recipes_by_name(connect: Connect) -> None:
    inputs = {"in1": ["input_int_register_24"], "in2": ["input_double_register_24", "input_int_register_25"]}
    async with connect(inputs=inputs) as robot:
        assert {name: held.recipe.names for name, held in robot.inputs.items()} == {
            "in1": ("input_int_register_24",),
            "in2": ("input_double_register_24", "input_int_register_25"),
        }
        assert [held.id for held in robot.inputs.values()] == [1, 2]
        assert robot.inputs["in2"].recipe.kinds["input_double_register_24"].word == "DOUBLE"


async def test_without_inputs_it_only_reads(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(outputs=["robot_mode"]) as robot:
        assert (await robot.newer(PATIENCE)).robot_mode == 7
        assert dict(robot.inputs) == {}
        with pytest.raises(ValueError, match="no input recipe is called 'in'; there are: none"):
            await robot.write("in", input_int_register_24=1)
    assert simulator.controller.claims.owner("input_int_register_24") is None


@pytest.mark.parametrize(
    "asked, applied", [(0, 500.0), (500, 500.0), (125, 125.0), (200, 250.0), (100, 100.0), (9999, 500.0)]
)
async def test_the_frequency_is_what_came_of_it(connect: Connect, asked: float, applied: float) -> None:
    """The controller divides its own rate by a whole number; 0 is that rate, and nothing is faster."""
    async with connect(outputs=["robot_mode"], frequency=asked) as robot:
        assert robot.frequency == pytest.approx(applied)
        assert robot.max_frequency == 500.0
        times = [(await robot.samples.next(PATIENCE)).timestamp for _ in range(10)]
        steps = [after - before for before, after in pairwise(times)]
        assert min(steps) == pytest.approx(1 / applied, abs=1e-6), "a busy machine may skip some"


@pytest.mark.parametrize("series, most", [(Series.CB3, 125.0), (Series.E, 500.0), (Series.X, 500.0)])
async def test_the_greatest_frequency_is_that_of_the_series(series: Series, most: float) -> None:
    async with (
        SimulatedController(Controller(series)) as served,
        rtde.connect("127.0.0.1", port=served.port) as robot,
    ):
        assert (robot.max_frequency, robot.series) == (most, series)


async def test_the_version_is_the_controllers(connect: Connect) -> None:
    async with connect() as robot:
        assert isinstance(robot.version, rtde.ControllerVersion)
        assert str(robot.version) == "5.26.0.0"
        assert robot.version.software == SoftwareVersion(5, 26)


@pytest.mark.parametrize("forced, spoken", [(1, 1), (2, 2), (None, 2)])
async def test_the_protocol_is_forced_or_the_newest(
    connect: Connect, forced: int | None, spoken: int
) -> None:
    async with connect(outputs=["robot_mode"], inputs=IN, protocol=forced) as robot:
        assert robot.protocol == spoken
        assert (await robot.newer(PATIENCE)).robot_mode == 7
        await robot.write("in", input_int_register_24=3, verify=True)


async def test_the_protocol_is_1_where_2_is_refused(connect: Connect, simulator: SimulatedController) -> None:
    simulator.faults.v1_only = True
    async with connect(outputs=["robot_mode"]) as robot:
        assert robot.protocol == 1
    with pytest.raises(rtde.ConnectFailedError, match="does not speak protocol version 2, which was forced"):
        await connect(protocol=2).open()


def test_protocol_3_is_refused() -> None:
    with pytest.raises(ValueError, match="protocol 3: RTDE has versions 1 and 2"):
        rtde.connect("127.0.0.1", protocol=3)


STATES: dict[str, ConnectionState] = {
    "before": ConnectionState.NEW,
    "connecting": ConnectionState.CONNECTING,
    "setting up": ConnectionState.INITIALISING,
    "running": ConnectionState.RUNNING,
    "not started": ConnectionState.PAUSED,
    "paused": ConnectionState.PAUSED,
    "lost": ConnectionState.LOST,
    "closed": ConnectionState.CLOSED,
}


@pytest.mark.parametrize("when", STATES)
async def test_the_state_is_how_far_it_is(
    connect: Connect, simulator: SimulatedController, when: str
) -> None:
    robot = connect(outputs=["robot_mode"], start=when != "not started", reconnect=None)
    opening = None
    if when in ("connecting", "setting up"):
        opening = asyncio.create_task(robot.open())
        await until(lambda: robot.state is STATES[when])
    elif when != "before":
        await robot.open()
    match when:
        case "paused":
            await robot.pause()
        case "lost":
            simulator.drop_clients()
            await until(lambda: robot.state is ConnectionState.LOST)
        case "closed":
            await robot.close()
    assert robot.state is STATES[when]
    assert robot.connected == (when in ("running", "not started", "paused"))
    if opening is not None:
        await opening
    await robot.close()


async def test_pause_stops_the_data_and_resume_starts_them(connect: Connect) -> None:
    """What they wait for is the controller's answer."""
    async with connect(outputs=["robot_mode"]) as robot:
        await robot.newer(PATIENCE)
        await robot.pause()
        states = [robot.state]
        robot.samples.take()
        with pytest.raises(TimeoutError):
            await robot.samples.next(0.01)
        await robot.resume()
        states.append(robot.state)
        await robot.samples.next(PATIENCE)
    assert states == [ConnectionState.PAUSED, ConnectionState.RUNNING]


async def test_start_false_waits_for_resume(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"], start=False) as robot:
        with pytest.raises(TimeoutError):
            await robot.newer(0.01)
        await robot.resume()
        assert (await robot.newer(PATIENCE)).robot_mode == 7


async def test_set_up_changes_the_recipes_while_paused(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"], inputs=IN) as robot:
        with pytest.raises(rtde.RtdeError, match="recipes can be changed while the output is paused"):
            await robot.set_up(outputs=["actual_q"])
        await robot.pause()
        await robot.set_up(outputs=["actual_q"], inputs={"other": ["input_int_register_30"]})
        await robot.resume()
        assert (await robot.newer(PATIENCE)).names == ("actual_q",)
        await robot.write("other", input_int_register_30=4, verify=True)


@pytest.mark.parametrize(
    "wishes",
    [
        pytest.param(lambda kind: {"outputs": {"actual_q": kind}}, id="outputs"),
        pytest.param(lambda kind: {"inputs": {"in": {"external_force_torque": kind}}}, id="inputs"),
    ],
)
async def test_declared_types_are_compared(connect: Connect, wishes: Callable[[str], dict[str, Any]]) -> None:
    async with connect(**wishes("VECTOR6D")) as robot:
        assert robot.unavailable == ()
    with pytest.raises(rtde.TypesDifferError, match="was declared as VECTOR3D, the controller has VECTOR6D"):
        await connect(**wishes("VECTOR3D")).open()


async def test_an_unknown_output_is_an_error_or_left_out(connect: Connect) -> None:
    """`strict` decides."""
    with pytest.raises(rtde.FieldsRefusedError, match=r"actual_p: NOT_FOUND.*did you mean actual_q"):
        await connect(outputs=["robot_mode", "actual_p"]).open()
    async with connect(outputs=["robot_mode", "actual_p"], strict=False) as robot:
        assert [each.field for each in robot.unavailable] == ["actual_p"]
        assert (await robot.newer(PATIENCE)).names == ("robot_mode",)


async def test_an_input_of_another_client_is_named_with_who_probably_holds_it(
    connect: Connect, simulator: SimulatedController
) -> None:
    simulator.controller.hold(["input_int_register_24"], "another client")
    with pytest.raises(rtde.FieldsRefusedError, match="input_int_register_24: IN_USE, probably claimed by"):
        await connect(inputs=IN).open()
    async with connect(inputs=IN, strict=False) as robot:
        assert [(each.field, each.word) for each in robot.unavailable] == [
            ("input_int_register_24", "IN_USE")
        ]
    simulator.controller.free(["input_int_register_24"])
    async with connect(inputs=IN) as robot:
        assert robot.unavailable == ()


@pytest.fixture
async def deaf() -> AsyncIterator[tuple[str, int]]:
    """An address at which connections are neither accepted nor refused: its queue is full."""
    loop = asyncio.get_running_loop()
    with socket.create_server(("127.0.0.1", 0), backlog=0) as listening:
        waiting = [socket.socket() for _ in range(4)]
        for each in waiting:
            each.setblocking(False)
            each.connect_ex(listening.getsockname())
        await asyncio.wait((loop.create_task(asyncio.sleep(0)),))
        yield listening.getsockname()
        for each in waiting:
            each.close()


@pytest.mark.parametrize("name", ["connect_timeout", "handshake_timeout", "data_timeout"])
async def test_each_wait_has_its_limit(
    connect: Connect, simulator: SimulatedController, deaf: tuple[str, int], name: str
) -> None:
    limit: dict[str, Any] = {name: 0.02}
    async with asyncio.timeout(0.9):  # less than each has by default
        match name:
            case "connect_timeout":
                with pytest.raises(rtde.ConnectFailedError, match="the robot does not answer"):
                    await rtde.connect(deaf[0], port=deaf[1], **limit).open()
            case "handshake_timeout":
                simulator.pause(PATIENCE)
                with pytest.raises(rtde.ConnectFailedError, match=r"did not arrive within 0\.02 s"):
                    await connect(**limit).open()
            case "data_timeout":
                async with connect(outputs=["robot_mode"], reconnect=None, **limit) as robot:
                    with suppress(rtde.ConnectionLostError):  # on a busy machine it may be over already
                        await robot.newer()
                    simulator.faults.silence = True
                    assert "no data from the controller" in str(await event(robot, rtde.LostEvent))


@pytest.mark.parametrize(
    "retry, attempts", [(rtde.Retry(connect_attempts=3, delay=0.001), 3), (rtde.Retry(connect_attempts=1), 1)]
)
async def test_attempts_to_connect_are_limited(
    connect: Connect, simulator: SimulatedController, retry: rtde.Retry, attempts: int
) -> None:
    await simulator.stop()
    robot = connect(retry=retry)
    with pytest.raises(rtde.ConnectFailedError, match="connection refused") as failure:
        await robot.open()
    assert failure.value.loss is not None
    assert failure.value.loss.attempts == attempts


@pytest.mark.parametrize("drops, succeeds", [(2, True), (3, False)])
async def test_attempts_to_set_up_are_limited(
    connect: Connect, simulator: SimulatedController, drops: int, succeeds: bool
) -> None:
    """Apart from those to connect."""
    simulator.faults.drop_at, simulator.faults.drop_times = DropAt(FaultStep.OUTPUTS), drops
    robot = connect(retry=rtde.Retry(connect_attempts=1, setup_attempts=3, delay=0.001))
    if succeeds:
        await robot.open()
        assert robot.connected
        await robot.close()
    else:
        with pytest.raises(rtde.ConnectFailedError):
            await robot.open()


async def test_the_wait_between_attempts_doubles_up_to_a_greatest(
    connect: Connect, simulator: SimulatedController
) -> None:
    await simulator.stop()
    robot = connect(retry=rtde.Retry(connect_attempts=5, delay=0.001, max_delay=0.003))
    with pytest.raises(rtde.ConnectFailedError):
        await robot.open()
    failed = [each for each in robot.events.take() if isinstance(each, rtde.AttemptFailedEvent)]
    assert [each.loss.retry_in for each in failed[:4]] == pytest.approx([0.001, 0.002, 0.003, 0.003])


async def test_a_loss_is_followed_by_a_new_connection_with_all_recipes(
    connect: Connect, simulator: SimulatedController
) -> None:
    """`reconnect` limits it; what was started runs again."""
    retry = rtde.Retry(delay=0.001)
    async with connect(outputs=["robot_mode"], inputs=IN, reconnect=retry, claim_timeout=PATIENCE) as robot:
        await robot.newer(PATIENCE)
        simulator.drop_clients()
        lost = await event(robot, rtde.LostEvent)
        assert (lost.final, lost.loss.retry_in) == (False, pytest.approx(0.001))
        await event(robot, rtde.StartedEvent)
        assert (await robot.newer(PATIENCE)).robot_mode == 7
        await robot.write("in", input_int_register_24=8, verify=True)
        assert robot.statistics.sessions == 2


async def test_a_new_connection_can_be_made_by_hand(connect: Connect, simulator: SimulatedController) -> None:
    async with connect(outputs=["robot_mode"], reconnect=None) as robot:
        simulator.drop_clients()
        assert (await event(robot, rtde.LostEvent)).final
        await robot.reconnect(PATIENCE)
        assert (await robot.newer(PATIENCE)).robot_mode == 7


async def test_the_boot_is_waited_for() -> None:
    """Until the controller has run for 40 s, or for as long as is asked for."""
    async with SimulatedController(Controller(uptime=39.9), stepped=True) as served:
        robot = rtde.connect("127.0.0.1", port=served.port, boot_wait=True, data_timeout=PATIENCE)
        opening = asyncio.create_task(robot.open())
        await until(lambda: served.streaming)
        await served.step(49)
        assert not opening.done()
        assert robot.latest is None or robot.latest.timestamp < 40
        await served.step(1)
        await opening
        assert robot.latest is not None
        assert robot.latest.timestamp >= 40
        waiting = asyncio.create_task(robot.booted(PATIENCE, uptime=40.01))
        await served.step(4)
        assert not waiting.done()
        await served.step(1)
        await waiting
        await robot.close()
