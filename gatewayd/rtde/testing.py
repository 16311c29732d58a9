"""Simulated robots for the tests of other people's RTDE software: a plugin of pytest.

In the `conftest.py` beside the tests:

    pytest_plugins = ["gatewayd.rtde.testing"]

and in a test, with any client that there is:

    @pytest.mark.simulated_robot("cell.toml")          # relative to the file of the test
    def test_my_program_survives_a_protective_stop(simulated_robot):
        program = MyProgram(simulated_robot.host, simulated_robot.port)
        simulated_robot.safety("protective-stop")
        assert program.paused()

The marker takes the arguments of `SimulatedRobot`: a scenario, or the keys of a robot; `replay=`, `stepped=True`,
`process=True`. `simulate_robot` is the same as a function, for several robots in one test.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

try:
    import pytest
except ImportError as error:
    message = "gatewayd.rtde.testing needs the package pytest: pip install 'gatewayd[testing]'"
    raise ImportError(message) from error

from gatewayd.simulator.double import RobotCommandError, RobotFaults, RobotHandle, SimulatedRobot
from gatewayd.simulator.scenario import ScenarioError

__all__ = [
    "RobotCommandError",
    "RobotFaults",
    "RobotHandle",
    "ScenarioError",
    "SimulatedRobot",
    "simulate_robot",
    "simulated_robot",
]

_MARKER = "simulated_robot"


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marker, for runs with strict markers."""
    config.addinivalue_line(
        "markers", f"{_MARKER}(scenario, **keys): the robot of the fixture `simulated_robot`"
    )


@pytest.fixture
def simulate_robot(request: pytest.FixtureRequest) -> Iterator[Callable[..., SimulatedRobot]]:
    """Starts a robot by the arguments of `SimulatedRobot`; it is stopped after the test.

    Files are relative to that of the test; FileNotFoundError says where one was looked for.
    """
    with ExitStack() as stack:

        def start(scenario: str | Path | None = None, **keys: Any) -> SimulatedRobot:
            replay = _beside(request.path, keys.pop("replay", None))
            robot = SimulatedRobot(_beside(request.path, scenario), replay=replay, **keys)
            return stack.enter_context(robot)

        yield start


@pytest.fixture
def simulated_robot(
    request: pytest.FixtureRequest, simulate_robot: Callable[..., SimulatedRobot]
) -> SimulatedRobot:
    """A robot of the test's own; the marker `simulated_robot` says which, an e-Series one without faults by default."""
    marker = request.node.get_closest_marker(_MARKER)
    return simulate_robot(*marker.args, **marker.kwargs) if marker is not None else simulate_robot()


def _beside(test: Path, file: str | Path | None) -> str | Path | None:
    """A file as the test names it; the content of a scenario stays what it is."""
    if file is None or "\n" in str(file):
        return file
    found = test.parent / file
    if not found.is_file():
        message = (
            f"there is no file {str(file)!r} for the simulated robot of {test.name}: it was looked for as {found}, "
            "relative to the file of the test"
        )
        raise FileNotFoundError(message)
    return found
