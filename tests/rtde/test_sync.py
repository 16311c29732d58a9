"""The blocking robot, against a simulator in a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from gatewayd import rtde
from gatewayd.rtde import sync

PATIENCE = 10.0


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """A simulator without faults."""
    command = [sys.executable, "-m", "gatewayd", "simulate", "--port", "0", "-q", "--version", "5.26"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    ) as process:
        assert process.stdout is not None
        yield int(process.stdout.readline().rsplit(":", 1)[1])
        process.terminate()


def test_every_package_comes_in_its_order_also_over_two_loops(port: int) -> None:
    with sync.connect("127.0.0.1", port=port, outputs=["actual_q"]) as robot:
        times = []
        for _ in range(2):
            for sample in robot:
                times.append(sample.timestamp)
                if len(times) % 40 == 0:
                    break
        times.append(robot.samples.next(PATIENCE).timestamp)
        robot.pause()
        times += [sample.timestamp for sample in robot.samples.take()]
        assert len(times) == robot.statistics.packages
    assert times == sorted(set(times))


def test_everything_else_blocks_until_it_is_done(port: int) -> None:
    inputs = {
        "in": ["input_int_register_0"],
        "bits": ["input_bit_registers0_to_31"],
        "io": [
            "standard_digital_output_mask",
            "standard_digital_output",
            "configurable_digital_output_mask",
            "configurable_digital_output",
            "tool_digital_output_mask",
            "tool_digital_output",
            "speed_slider_mask",
            "speed_slider_fraction",
            "standard_analog_output_mask",
            "standard_analog_output_type",
            "standard_analog_output_0",
        ],
    }
    with sync.connect("127.0.0.1", port=port, outputs=["robot_mode"], inputs=inputs) as robot:
        robot.write("in", input_int_register_0=7, verify=True)
        assert robot.known("in") == {"input_int_register_0": 7}
        robot.set_input_bits({3: True}, verify=True)
        robot.set_standard_digital_outputs({1: True}, verify=True)
        robot.set_configurable_digital_outputs({1: True}, verify=True)
        robot.set_tool_digital_outputs({1: True}, verify=True)
        robot.set_speed_slider(0.5, verify=True)
        robot.set_analog_output(0, volts=2.5, verify=True)
        assert robot.newer(PATIENCE).actual_digital_output_bits == 1 << 1 | 1 << 9 | 1 << 17
        robot.booted(PATIENCE)
        robot.pause()
        assert robot.state is rtde.ConnectionState.PAUSED
        robot.set_up(outputs=["target_q"], frequency=125)
        robot.resume()
        assert robot.newer(PATIENCE).names == ("target_q",)
        robot.message("hello")
        assert robot.properties().answered
        robot.reconnect(PATIENCE)
        assert robot.version.major == 5
        kinds = {type(event) for event in robot.events.take()}
        assert {rtde.ConnectedEvent, rtde.PausedEvent, rtde.LostEvent} <= kinds
        with pytest.raises(TimeoutError):
            robot.events.next(0.01)
    assert [sample.names for sample in robot.samples][-1] == ("target_q",)
    assert robot.events.take()[-1:] == []
    assert list(robot.events) == []
    with pytest.raises(rtde.RtdeError, match="not open"):
        robot.newer()
    robot.close()


def test_what_fails_to_open_leaves_no_thread() -> None:
    before = threading.active_count()
    with pytest.raises(rtde.ConnectFailedError, match="connection refused"):
        sync.connect("127.0.0.1", port=1).open()
    assert threading.active_count() == before


SCRIPT = """
from gatewayd.rtde import sync
try:
    with sync.connect("127.0.0.1", port=int({port}), outputs=["robot_mode"], start=False) as robot:
        print("waiting", flush=True)
        robot.newer()
except KeyboardInterrupt:
    print(robot.state.value)
"""


def test_ctrl_c_ends_a_wait_and_the_robot_is_closed(port: int) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT.format(port=port)], stdout=subprocess.PIPE, text=True
    ) as script:
        assert script.stdout is not None
        assert script.stdout.readline() == "waiting\n"
        script.send_signal(signal.SIGINT)
        assert script.communicate(timeout=PATIENCE)[0] == "closed\n"
    assert script.returncode == 0


def test_a_wait_within_its_own_loop_is_refused(port: int) -> None:
    with sync.connect("127.0.0.1", port=port) as robot:
        refused: list[BaseException] = []

        async def nested() -> None:
            try:
                robot.newer()
            except rtde.RtdeError as error:
                refused.append(error)

        assert robot._reader is not None
        robot._reader.run(nested())
        assert "wait for itself" in str(refused[0])
