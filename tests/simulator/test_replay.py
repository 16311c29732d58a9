"""A recording as the robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde.messages import DataPackage, Start, StartReply
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import RecordingError, create_recording
from gatewayd.rtde.types import DataType
from gatewayd.simulator.fleet import RobotHost, replayed_robots
from gatewayd.simulator.replay import RecordedRobot, Replay
from gatewayd.simulator.server import SimulatedController
from gatewayd.simulator.settings import RobotSettings, read_field

if TYPE_CHECKING:
    from tests.simulator.conftest import Client, Process

RECIPE = Recipe(
    ("timestamp", "actual_q", "robot_status_bits", "input_int_register_0"),
    (DataType.DOUBLE, DataType.VECTOR6D, DataType.UINT32, DataType.INT32),
)


def recording(path: Path, times: list[float], *, binary: bool = False) -> Path:
    """One package for each time, numbered in all its fields."""
    with create_recording(path, RECIPE, binary=binary) as writer:
        for number, time in enumerate(times):
            writer.write((time, *(number + joint / 10 for joint in range(6)), number, number))
    return path


def replayed(
    path: Path, *, repeat: bool = False, settings: RobotSettings | None = None
) -> SimulatedController:
    host = RobotHost(ports=(0,), stepped=True)
    return replayed_robots(path, settings or RobotSettings(), host, repeat=repeat)["robot"]


def times(count: int, period: float = 0.002) -> list[float]:
    return [50 + number * period for number in range(count)]


@pytest.mark.parametrize("binary", [False, True])
async def test_every_row_comes_once_and_in_order(tmp_path: Path, client: type[Client], binary: bool) -> None:
    recorded = times(50)
    async with (
        replayed(recording(tmp_path / "data", recorded, binary=binary)) as robot,
        client(robot.port) as one,
    ):
        await robot.step(20)  # nobody has started yet: nothing is missed
        await one.stream("actual_q", "timestamp", "robot_status_bits")
        await robot.step(60)
        found = [await one.package() for _ in range(50)]
    assert [values[6] for values in found] == pytest.approx(recorded)
    assert [values[7] for values in found] == list(range(50))
    assert found[7][:6] == pytest.approx((7.0, 7.1, 7.2, 7.3, 7.4, 7.5))


async def test_nothing_is_sent_where_packages_were_lost_and_after_the_end(
    tmp_path: Path, client: type[Client]
) -> None:
    recorded = [*times(3), 50.02, 50.022]
    ended = []
    async with replayed(recording(tmp_path / "data.csv", recorded)) as robot, client(robot.port) as one:
        robot.ended = lambda: ended.append(robot.controller.cycle)
        await one.stream("timestamp")
        quiet = []
        for _ in range(16):
            await robot.step()
            quiet.append(robot.controller.quiet)
        assert [cycle for cycle, nothing in enumerate(quiet) if not nothing] == [0, 1, 2, 10, 11]
        assert ended == [13]
        assert [(await one.package())[0] for _ in range(5)] == pytest.approx(recorded)


async def test_a_loop_goes_on_in_time(tmp_path: Path, client: type[Client]) -> None:
    path = recording(tmp_path / "data.csv", times(4, 0.008))
    async with replayed(path, repeat=True) as robot, client(robot.port) as one:
        assert robot.controller.rate == 125
        await one.stream("timestamp", "robot_status_bits")
        await robot.step(10)
        found = [await one.package() for _ in range(10)]
    assert [values[0] for values in found] == pytest.approx(times(10, 0.008))
    assert [values[1] for values in found] == [0, 1, 2, 3, 0, 1, 2, 3, 0, 1]


async def test_a_controller_that_was_started_anew_is_shown_without_a_pause(
    tmp_path: Path, client: type[Client]
) -> None:
    recorded = [50.0, 50.002, 0.0, 0.002, 0.004]
    async with replayed(recording(tmp_path / "data.csv", recorded)) as robot, client(robot.port) as one:
        await one.stream("timestamp")
        await robot.step(5)
        assert [(await one.package())[0] for _ in range(5)] == pytest.approx(recorded)


@pytest.mark.parametrize("fault", ["freeze", "creep"])
async def test_a_frozen_timestamp_holds_the_row(tmp_path: Path, client: type[Client], fault: str) -> None:
    """Packages go on, and the recording behind the one that was shown again and again: no row is passed over."""
    async with replayed(recording(tmp_path / "data", times(20))) as robot, client(robot.port) as one:
        await one.stream("timestamp", "actual_q")
        await robot.step(5)
        setattr(robot.faults, fault, True)
        await robot.step(10)
        setattr(robot.faults, fault, False)
        await robot.step(5)
        found = [await one.package() for _ in range(20)]
    assert [values[1] for values in found] == [*range(5), *[4] * 10, *range(5, 10)]
    stamps = [float(values[0]) for values in found]
    creep = 1e-9 if fault == "creep" else 0
    assert stamps[4:15] == pytest.approx([50.008 + creep * number for number in range(11)], abs=1e-12)
    assert stamps[15:] == pytest.approx([50.01 + 0.002 * number for number in range(5)])


async def test_a_replay_that_is_frozen_from_the_start_shows_its_first_row(
    tmp_path: Path, client: type[Client]
) -> None:
    async with replayed(recording(tmp_path / "data", times(20))) as robot, client(robot.port) as one:
        robot.faults.freeze = True
        await robot.step(7)
        await one.stream("timestamp", "actual_q")
        await robot.step(3)
        robot.faults.freeze = False
        await robot.step(3)
        found = [await one.package() for _ in range(6)]
    assert [values[1] for values in found] == [0, 0, 0, 0, 1, 2]


async def test_fields_that_were_not_recorded_do_not_exist(tmp_path: Path, client: type[Client]) -> None:
    settings = RobotSettings(fields=(read_field("dexterity:DOUBLE"),))
    robot = replayed(recording(tmp_path / "data.csv", times(3)), settings=settings)
    async with robot, client(robot.port) as one:
        assert await one.negotiate()
        reply = await one.outputs("actual_q", "actual_TCP_pose", "dexterity", "input_int_register_5")
        assert reply.types == ("VECTOR6D", "NOT_FOUND", "DOUBLE", "INT32")


async def test_a_recorded_input_is_shown_until_a_client_claims_it(
    tmp_path: Path, client: type[Client]
) -> None:
    async with replayed(recording(tmp_path / "data.csv", times(9))) as robot, client(robot.port) as one:
        await one.stream("input_int_register_0")
        await robot.step(3)
        assert [await one.package() for _ in range(3)] == [(0,), (1,), (2,)]
        assert (await one.inputs("input_int_register_0")).recipe == 1
        one.send(DataPackage(1, b"\0\0\0\x63"), Start())
        await one.receive(StartReply)
        await robot.step(2)
        assert [await one.package() for _ in range(2)] == [(99,), (99,)]


async def test_what_is_overwritten_prevails(tmp_path: Path) -> None:
    async with replayed(recording(tmp_path / "data.csv", times(9))) as robot:
        robot.controller.overwrite("robot_status_bits", (7,))
        await robot.step(3)
        assert robot.get("robot_status_bits") == 7


async def test_a_file_that_breaks_off_says_why(tmp_path: Path, client: type[Client]) -> None:
    path = tmp_path / "data.csv"
    rows = "".join(f"{50 + number / 500} {number}\n" for number in range(600))
    path.write_text(f"timestamp output_int_register_0\n{rows}51.2 x\n51.202 3\n")
    async with replayed(path) as robot, client(robot.port) as one:
        await one.stream("output_int_register_0")
        await robot.step(610)
        assert isinstance(robot.follower, Replay)
        assert robot.follower.problem is not None
        assert f"{path}:602" in robot.follower.problem


@pytest.mark.parametrize(
    "stamps,rate",
    [
        (times(9), 500),
        (times(9, 0.008), 125),
        ([1.0, 1.0, 1.0], None),
        ([1.0], None),
        (times(3, 1e-6), 1000),
        (times(3, 60), 1),
    ],
)
def test_the_rate_is_that_of_the_timestamps(tmp_path: Path, stamps: list[float], rate: float | None) -> None:
    assert RecordedRobot(recording(tmp_path / "data.csv", stamps)).rate == rate


def test_a_recording_without_packages_cannot_be_replayed(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has no package to replay"):
        RecordedRobot(recording(tmp_path / "data.csv", []))


async def test_the_process_ends_with_the_recording(
    tmp_path: Path, process: Callable[..., Process], client: type[Client]
) -> None:
    path = recording(tmp_path / "data.csv", times(100))
    served = process("--replay", str(path))
    async with client(served.port) as one:
        await one.stream("timestamp")
        first = await one.package()
        assert first == (50.0,)
        await one.ended()
    assert served.popen.wait(10) == 0
