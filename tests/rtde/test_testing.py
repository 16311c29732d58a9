"""The fixtures for other people's tests, run as other people run them: pytest in a process, in a folder of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CONFTEST = 'pytest_plugins = ["gatewayd.rtde.testing"]\n'
SCENARIO = '[robots.left]\nstart = "power off"\n'
TEST = '''\
import socket

import pytest

from gatewayd.rtde.testing import SimulatedRobot


def test_a_robot_without_a_marker(simulated_robot):
    assert isinstance(simulated_robot, SimulatedRobot)
    assert simulated_robot.get("robot_mode") == 7
    socket.create_connection((simulated_robot.host, simulated_robot.port)).close()


@pytest.mark.simulated_robot("cell.toml", stepped=True)
def test_a_scenario_beside_the_test(simulated_robot):
    assert simulated_robot.name == "left"
    assert simulated_robot.step() == 1
    assert simulated_robot.get("robot_mode") == 3


@pytest.mark.simulated_robot(series="cb3", process=True)
def test_keys(simulated_robot):
    assert simulated_robot.get("timestamp") >= 100


@pytest.mark.simulated_robot(replay="data.csv")
def test_a_recording(simulated_robot):
    assert simulated_robot.get("output_int_register_0") == 8


def test_several(simulate_robot):
    one, other = simulate_robot(), simulate_robot("""
[robots.other]
""")
    assert (one.name, other.name) == ("robot", "other")
'''


def run(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:asyncio",
        *options,
        str(folder),
    ]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.slow
def test_the_fixtures_work_in_a_project_of_others(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "cell.toml").write_text(SCENARIO)
    (tmp_path / "data.csv").write_text("timestamp output_int_register_0\n1.0 8\n")
    (tmp_path / "test_mine.py").write_text(TEST)
    ended = run(tmp_path, "--strict-markers", "-W", "error")
    assert "5 passed" in ended.stdout, ended.stdout + ended.stderr
    assert ended.returncode == 0


def test_a_file_that_is_not_there_is_named_with_its_place(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_mine.py").write_text(
        """
import pytest
@pytest.mark.simulated_robot("no.toml")
def test_of_a_scenario(simulated_robot): ...
@pytest.mark.simulated_robot(replay="no.csv")
def test_of_a_recording(simulated_robot): ...
"""
    )
    ended = run(tmp_path)
    assert "2 errors" in ended.stdout
    for name in ("no.toml", "no.csv"):
        assert f"there is no file {name!r} for the simulated robot of test_mine.py" in ended.stdout
        assert f"it was looked for as {tmp_path / name}" in ended.stdout


def test_without_pytest_the_error_names_the_extra() -> None:
    program = "import sys; sys.modules['pytest'] = None; import gatewayd.rtde.testing"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "needs the package pytest: pip install 'gatewayd[testing]'" in ended.stderr


def test_only_this_module_needs_pytest() -> None:
    program = "import sys; import gatewayd.simulator.double; print('pytest' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ended.stdout == "False\n", ended.stderr
