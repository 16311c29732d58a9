"""The robots of one process: of options, of a scenario or of a recording, each with its own state and port."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from gatewayd.report.format import counted
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard import DEFAULT_PROGRAMS, PolyScope
from gatewayd.simulator.dashboard_server import DashboardServer
from gatewayd.simulator.program import ProgramError
from gatewayd.simulator.replay import RecordedRobot, Replay
from gatewayd.simulator.scenario import Scenario, ScenarioError
from gatewayd.simulator.server import MAX_CONNECTIONS, SimulatedController
from gatewayd.simulator.settings import RobotSettings
from gatewayd.simulator.timeline import Timeline

DEFAULT_PORT = 30004
"""Where a controller listens."""

Robots = dict[str, SimulatedController]
"""Robots by their names, none of them started."""


@dataclass(frozen=True, slots=True)
class DashboardHost:
    """Where the dashboard servers of robots are, and what they find."""

    port: int = 0
    """Of the first robot; others follow. 0 takes free ones."""
    programs: tuple[str, ...] = DEFAULT_PROGRAMS
    local: bool = False
    """Whether e-Series controllers begin in local control."""

    def server(self, controller: Controller, host: str, number: int) -> DashboardServer:
        """The one of robot `number`, from 0. ValueError for a PolyScope X controller."""
        polyscope = PolyScope(controller, self.programs)
        polyscope.remote = not self.local
        return DashboardServer(polyscope, host, self.port + number if self.port else 0)


@dataclass(frozen=True, slots=True)
class RobotHost:
    """Where robots are served, and how their time passes."""

    host: str = "127.0.0.1"
    ports: tuple[int, ...] = ()
    """One for each robot; or the first, which others follow; 0 takes free ones. Empty: those of the scenario."""
    connections: int = MAX_CONNECTIONS
    speed: float = 1.0
    stepped: bool = False
    dashboard: DashboardHost | None = None

    def serve(self, settings: RobotSettings, port: int, number: int = 0) -> SimulatedController:
        """Robot `number`, from 0, on a port of this host. ProgramError and ValueError as `Controller` raises them."""
        simulator = SimulatedController(
            settings.controller(),
            host=self.host,
            port=port,
            connections=self.connections,
            speed=self.speed,
            stepped=self.stepped,
        )
        if self.dashboard is not None:
            simulator.dashboard = self.dashboard.server(simulator.controller, self.host, number)
        return simulator

    def port(self, number: int, declared: int | None = None) -> int:
        """The port of robot `number`, from 0."""
        if not self.ports:
            return declared if declared is not None else DEFAULT_PORT + number
        if len(self.ports) > 1:
            return self.ports[number]
        return self.ports[0] + number if self.ports[0] else 0


def plain_robots(settings: RobotSettings, at: RobotHost) -> Robots:
    """Equal robots, one for each port; the single one is `robot`, several are `robot1`, `robot2` and so on."""
    return _each(lambda port, number: at.serve(settings, port, number), at)


def scenario_robots(scenario: Scenario, at: RobotHost) -> Robots:
    """The robots of a scenario, each with its timeline.

    ScenarioError for what a robot does not have, ValueError if there are several ports, but not one for each robot.
    """
    if len(at.ports) > 1 and len(at.ports) != len(scenario.robots):
        there, given = counted(len(scenario.robots), "robot"), counted(len(at.ports), "port")
        message = f"{scenario.file} has {there}, not {given}; give one port, or one for each robot"
        raise ValueError(message)
    robots: Robots = {}
    for number, robot in enumerate(scenario.robots):
        try:
            simulator = at.serve(robot.settings, at.port(number, robot.port), number)
        except ProgramError as error:
            message = str(error).split(": ", 1)[-1]
            raise ScenarioError(scenario.file, robot.program_line(error.line), message) from None
        except ValueError as error:
            raise ScenarioError(scenario.file, robot.line, f"robot {robot.name!r}: {error}") from None
        simulator.follower = Timeline(simulator, robot, scenario.file)
        robots[robot.name] = simulator
    return robots


def replayed_robots(path: str | Path, settings: RobotSettings, at: RobotHost, *, repeat: bool) -> Robots:
    """A recording on each port. RecordingError if it cannot be read, ValueError as `Controller` raises it."""

    def recorded(port: int, number: int) -> SimulatedController:
        recording = RecordedRobot(path)
        own = {field.name: field for field in (*settings.fields, *recording.fields)}
        simulator = at.serve(
            replace(
                settings,
                frequency=settings.frequency or recording.rate,
                fields=tuple(own.values()),
                replayed=recording.recipe.names,
            ),
            port,
            number,
        )
        simulator.follower = Replay(simulator, recording, repeat=repeat)
        return simulator

    return _each(recorded, at)


def _each(robot: Callable[[int, int], SimulatedController], at: RobotHost) -> Robots:
    ports = at.ports or (DEFAULT_PORT,)
    if len(ports) == 1:
        return {"robot": robot(ports[0], 0)}
    return {f"robot{number + 1}": robot(port, number) for number, port in enumerate(ports)}
