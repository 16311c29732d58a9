"""ur_rtde, an independent client, talks to the simulator. It runs in its own process: it cannot be interrupted."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from gatewayd.rtde.recording import open_recording

if TYPE_CHECKING:
    from tests.simulator.conftest import Process

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("rtde_receive") is None, reason="ur_rtde is not installed here"
)

RECEIVE = """
from rtde_receive import RTDEReceiveInterface
receive = RTDEReceiveInterface(HOST, 125.0, [], False, False, 0)
def until(condition, patience=10.0):
    end = time.time() + patience
    while not condition() and time.time() < end:
        time.sleep(0.02)
"""
MOVES = """
first = [receive.getTimestamp(), receive.getActualQ(), receive.getActualTCPPose()]
until(lambda: receive.getTimestamp() > first[0] + 0.3)
second = [receive.getTimestamp(), receive.getActualQ(), receive.getActualTCPPose()]
result = [first, second, receive.getRobotMode(), receive.getRuntimeState(), receive.getPayload()]
receive.disconnect()
"""
WRITES = """
from rtde_io import RTDEIOInterface
io = RTDEIOInterface(HOST)
sent = [io.setInputIntRegister(n, 100 + n) for n in range(18, 23)]
sent += [io.setInputDoubleRegister(n, n / 4) for n in range(18, 23)]
sent += [io.setStandardDigitalOut(3, True), io.setConfigurableDigitalOut(2, True), io.setToolDigitalOut(1, True)]
sent += [io.setSpeedSlider(0.5), io.setAnalogOutputVoltage(0, 0.5), io.setAnalogOutputCurrent(1, 0.25)]
until(lambda: receive.getStandardAnalogOutput1() == 8.0)
result = [
    sent,
    [receive.getOutputIntRegister(n) for n in range(18, 20)],
    [receive.getOutputDoubleRegister(n) for n in range(18, 20)],
    receive.getActualDigitalOutputBits(),
    receive.getTargetSpeedFraction(),
    receive.getStandardAnalogOutput0(),
    receive.getStandardAnalogOutput1(),
]
io.disconnect()
receive.disconnect()
"""


def own_host() -> str:
    """A loopback address for this test process alone: ur_rtde always dials port 30004."""
    number = os.getpid()
    return f"127.30.{number // 250 % 250 + 1}.{number % 250 + 1}"


def ur_rtde(process: Callable[..., Process], script: str, *options: str) -> Any:
    """Run `script` against a new simulator and return its `result`."""
    host = own_host()
    process("--host", host, "--port", "30004", "--program", "demo", *options)
    program = f"import json, time\nHOST = {host!r}\n{RECEIVE}{script}\nprint(json.dumps(result))\n"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_it_reads_moving_values(process: Callable[..., Process]) -> None:
    first, second, robot_mode, runtime_state, payload = ur_rtde(process, MOVES)
    assert second[0] - first[0] == pytest.approx(0.3, abs=0.2)
    for before, after in zip(first[1:], second[1:], strict=True):
        assert len(before) == 6
        assert before != after
        assert before == pytest.approx(after, abs=0.5)
    assert (robot_mode, runtime_state, payload) == (7, 2, 1.2)


def test_its_writes_arrive_without_outputs_and_start(process: Callable[..., Process]) -> None:
    sent, integers, doubles, bits, slider, volts, milliamperes = ur_rtde(process, WRITES)
    assert all(sent)
    assert (integers, doubles) == ([118, 119], [4.5, 4.75])
    assert bits == 1 << 3 | 1 << 8 + 2 | 1 << 16 + 1
    assert (slider, volts, milliamperes) == (0.5, 5.0, 8.0)


def test_it_is_told_of_inputs_in_use(process: Callable[..., Process]) -> None:
    script = """
from rtde_io import RTDEIOInterface
try:
    RTDEIOInterface(HOST)
    result = None
except RuntimeError as error:
    result = str(error)
receive.disconnect()
"""
    assert "already in use" in ur_rtde(process, script, "--hold", "input_int_register_20")


def test_it_works_with_a_cb3(process: Callable[..., Process]) -> None:
    first, second, *_ = ur_rtde(process, MOVES, "--series", "cb3")
    assert second[0] > first[0]


def test_its_recording_is_read_with_the_fields_of_the_controller(
    process: Callable[..., Process], tmp_path: Path
) -> None:
    """Text with commas, made by a recorder that knows nothing of ours."""
    script = f"""
receive.startFileRecording({str(tmp_path / "theirs.csv")!r}, [])
begin = receive.getTimestamp()
until(lambda: receive.getTimestamp() > begin + 0.5)
receive.stopFileRecording()
result = [begin, receive.getTimestamp()]
receive.disconnect()
"""
    begin, end = ur_rtde(process, script)
    with open_recording(tmp_path / "theirs.csv") as recording:
        kinds = recording.recipe.kinds
        rows = list(recording)
    assert {name: kinds[name].word for name in ("timestamp", "actual_q", "robot_mode", "runtime_state")} == {
        "timestamp": "DOUBLE",
        "actual_q": "VECTOR6D",
        "robot_mode": "INT32",
        "runtime_state": "UINT32",
    }
    times = [row[recording.recipe.slots["timestamp"].start] for row in rows]
    assert times == sorted(times)
    assert begin - 0.1 <= times[0] <= times[-1] <= end + 0.1
    assert {row[recording.recipe.slots["robot_mode"].start] for row in rows} == {7}
