"""A blocking robot that reads its packages itself, and leaves the socket to its loop for everything else."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from gatewayd import rtde
from gatewayd.rtde import sync
from gatewayd.rtde.loss import LossReason
from gatewayd.rtde.recipe import Scalar
from gatewayd.simulator.double import SimulatedRobot

PATIENCE = 10.0
QUICKLY = rtde.Retry(delay=0.01, max_delay=0.05)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt, also where whoever started the tests has it ignored."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


@pytest.fixture(scope="module")
def simulator() -> Iterator[SimulatedRobot]:
    """A robot in a thread of this process."""
    with SimulatedRobot(version="5.26") as robot:
        yield robot


@pytest.fixture
def robot(simulator: SimulatedRobot) -> Iterator[sync.BlockingRobot]:
    """A blocking robot that reads directly: it was asked for samples several times in a row."""
    with sync.connect(
        "127.0.0.1",
        port=simulator.port,
        outputs=["actual_q"],
        inputs={"in": ["input_int_register_0"]},
        reconnect=QUICKLY,
    ) as robot:
        read_directly(robot)
        yield robot


def read_directly(robot: sync.BlockingRobot) -> list[float]:
    """Read until the packages come by way of this thread; the timestamps that were read."""
    stamps: list[float] = []
    while not reads_directly(robot):
        stamps.append(robot.samples.next(PATIENCE).timestamp)
    return stamps


def reads_directly(robot: sync.BlockingRobot) -> bool:
    receiver = robot._client.receiver
    return receiver is not None and receiver.direct


def read_until_session(robot: sync.BlockingRobot, number: int) -> None:
    """Read samples until they are those of this session."""
    while robot.statistics.sessions < number:
        robot.samples.next(PATIENCE)


def read_for_ever(robot: sync.BlockingRobot, timeout: float, stamps: list[float]) -> None:
    while True:
        stamps.append(robot.samples.next(timeout).timestamp)


def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def test_packages_are_taken_in_by_the_thread_that_waits(
    robot: sync.BlockingRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads: list[int] = []
    taken = robot._feed.values

    def values(flat: tuple[Scalar, ...], now: float) -> None:
        threads.append(threading.get_ident())
        taken(flat, now)

    monkeypatch.setattr(robot._feed, "values", values)
    for _ in range(50):
        robot.samples.next(PATIENCE)
    # A machine that stands still for 0.1 s has the loop read once in between.
    assert threads.count(threading.get_ident()) > len(threads) / 2
    stamps = [robot.newer(PATIENCE).timestamp for _ in range(5)]
    assert stamps == sorted(set(stamps))


@pytest.mark.parametrize("frequency", [0, 25])
def test_every_package_comes_in_its_order_however_the_program_pauses(
    simulator: SimulatedRobot, frequency: float
) -> None:
    inputs = {"in": ["input_int_register_0"]}
    with sync.connect("127.0.0.1", port=simulator.port, inputs=inputs, frequency=frequency) as robot:
        stamps = [] if frequency else read_directly(robot)
        for number in range(8 if frequency else 150):
            stamps.append(robot.samples.next(PATIENCE).timestamp)
            if number % 30 == 29:
                time.sleep(0.05 * (number // 30))
            if number % 40 == 6:
                robot.write("in", input_int_register_0=number)
            if number % 50 == 3:
                assert robot.latest is not None
                assert robot.latest.timestamp >= stamps[-1]
        robot.pause()
        stamps += [sample.timestamp for sample in robot.samples.take()]
        assert stamps == sorted(set(stamps))
        assert len(stamps) == robot.statistics.packages
        assert robot.overflowed == 0


def test_a_program_that_stops_reading_has_the_loop_read_again(robot: sync.BlockingRobot) -> None:
    packages = robot.statistics.packages
    until(lambda: not reads_directly(robot))
    until(lambda: robot.statistics.packages > packages + 20)
    stamps = [robot.samples.next(PATIENCE).timestamp for _ in range(20)]
    read_directly(robot)
    assert stamps == sorted(set(stamps))


def test_what_the_program_does_in_between_sees_what_had_come(
    robot: sync.BlockingRobot, simulator: SimulatedRobot
) -> None:
    simulator.faults.text("hello")
    assert reads_directly(robot)
    until(lambda: any("hello" in str(event) for event in robot.events.take()))
    robot.write("in", input_int_register_0=7, verify=True)
    assert robot.known("in") == {"input_int_register_0": 7}
    read_directly(robot)
    simulator.faults.text("again")
    for _ in range(20):
        robot.samples.next(PATIENCE)
    assert robot.last_text is not None
    assert robot.last_text.message == "again"


def test_waiting_for_an_event_reads_the_packages_that_come_meanwhile(
    robot: sync.BlockingRobot, simulator: SimulatedRobot
) -> None:
    robot.events.take()
    packages = robot.statistics.packages
    with pytest.raises(TimeoutError):
        robot.events.next(0.03)
    sending = threading.Timer(0.05, simulator.faults.text, ("late",))
    sending.start()
    assert "late" in str(robot.events.next(PATIENCE))
    sending.join()
    assert robot.statistics.packages > packages
    assert robot.samples.take()


def test_a_time_limit_holds_also_where_nothing_comes(
    robot: sync.BlockingRobot, simulator: SimulatedRobot
) -> None:
    simulator.faults.pause(0.3)
    with pytest.raises(TimeoutError):
        read_for_ever(robot, 0.05, [])
    robot.newer(0.0)
    with pytest.raises(TimeoutError):
        robot.newer(0.0)


def test_a_silent_controller_is_lost_and_the_samples_go_on_after_it(simulator: SimulatedRobot) -> None:
    with sync.connect("127.0.0.1", port=simulator.port, data_timeout=0.2) as robot:
        read_directly(robot)
        simulator.faults.pause(0.5)
        read_until_session(robot, 2)
        assert robot.last_loss is not None
        assert robot.last_loss.reason is LossReason.SILENT
        read_directly(robot)


def test_a_closed_connection_is_lost_and_the_samples_go_on_after_it(
    robot: sync.BlockingRobot, simulator: SimulatedRobot
) -> None:
    sessions = robot.statistics.sessions
    simulator.faults.drop_clients()
    read_until_session(robot, sessions + 1)
    assert robot.last_loss is not None
    assert robot.last_loss.reason is LossReason.CLOSED
    assert rtde.LostEvent in {type(event) for event in robot.events.take()}
    read_directly(robot)


def test_a_restarted_controller_is_noticed_by_the_thread_that_reads(
    robot: sync.BlockingRobot, simulator: SimulatedRobot
) -> None:
    sessions = robot.statistics.sessions
    simulator.restart()
    read_until_session(robot, sessions + 1)
    read_directly(robot)


def test_without_reconnecting_the_reader_gets_the_error(simulator: SimulatedRobot) -> None:
    with sync.connect("127.0.0.1", port=simulator.port, reconnect=None) as robot:
        read_directly(robot)
        simulator.faults.drop_clients()
        with pytest.raises(rtde.ConnectionLostError, match="closed by the controller"):
            read_for_ever(robot, PATIENCE, [])
        with pytest.raises(rtde.ConnectionLostError):
            robot.newer(PATIENCE)


def test_bytes_that_are_no_rtde_end_the_session_in_the_thread_that_reads(
    robot: sync.BlockingRobot, simulator: SimulatedRobot
) -> None:
    sessions = robot.statistics.sessions
    simulator.faults.raw(b"\x00\x01\x02")
    read_until_session(robot, sessions + 1)
    assert robot.last_loss is not None
    assert robot.last_loss.reason is LossReason.PROTOCOL


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_ends_a_direct_wait_and_nothing_is_lost(robot: sync.BlockingRobot) -> None:
    robot.events.take()
    read_directly(robot)
    signalling = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    signalling.start()
    stamps: list[float] = []
    with pytest.raises(KeyboardInterrupt):
        read_for_ever(robot, PATIENCE, stamps)
    signalling.join()
    stamps.append(robot.samples.next(PATIENCE).timestamp)
    assert stamps == sorted(set(stamps))
    assert robot.state is rtde.ConnectionState.RUNNING


def test_an_interrupt_amid_a_package_costs_the_connection_and_not_the_robot(
    robot: sync.BlockingRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(_values: tuple[Scalar, ...], _now: float) -> None:
        raise KeyboardInterrupt

    sessions = robot.statistics.sessions
    with monkeypatch.context() as patched:
        patched.setattr(robot._feed, "values", interrupted)
        with pytest.raises(KeyboardInterrupt):
            robot.samples.next(PATIENCE)
    read_until_session(robot, sessions + 1)
    assert robot.last_loss is not None
    assert robot.last_loss.reason is LossReason.FAILED
    assert "interrupted" in robot.last_loss.text


def test_a_robot_is_closed_at_once_though_its_packages_were_read_directly(simulator: SimulatedRobot) -> None:
    for _ in range(3):
        with sync.connect("127.0.0.1", port=simulator.port) as robot:
            read_directly(robot)
            begun = time.monotonic()
        assert time.monotonic() - begun < 0.15, "the farewell was not heard"
        assert robot.latest is None
        assert robot.state is rtde.ConnectionState.CLOSED
