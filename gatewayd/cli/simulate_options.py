"""What the options of `gatewayd simulate` mean together: the robots; UsageError for what contradicts itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from gatewayd.simulator.fleet import DashboardHost, RobotHost, Robots
    from gatewayd.simulator.program import ProgramRule
    from gatewayd.simulator.settings import RobotSettings

_ABOUT_THE_PROCESS = frozenset(
    {
        "host",
        "ports",
        "connections",
        "control",
        "quiet",
        "speed",
        "stepped",
        "scenario",
        "dashboard",
        "dashboard_programs",
        "local_control",
    }
)
"""Options beside --scenario: the others describe a robot, as the file does."""
_NOT_REPLAYED = frozenset({"programs", "program_files", "model", "uptime", "boot_restart"})
"""Options that mean nothing where a recording is the robot."""


class MistakeInFileError(click.ClickException):
    """One line without the usage: it names the place itself."""

    exit_code = 2


class UnreadableRecordingError(Exception):
    """A recording that cannot be replayed."""


def robots_of(
    ctx: click.Context,
    *,
    host: str,
    ports: tuple[int, ...],
    connections: int,
    speed: float,
    stepped: bool,
    dashboard: int | None,
    dashboard_programs: str | None,
    local_control: bool,
    scenario: Path | None,
    replay: Path | None,
    loop: bool,
    **options: Any,
) -> Robots:
    """The robots that the options ask for.

    UsageError for options that contradict each other, MistakeInFileError for a file that says what it must not,
    UnreadableRecordingError.
    """
    from gatewayd.simulator.fleet import RobotHost, plain_robots
    from gatewayd.simulator.program import ProgramError

    if stepped:
        _refuse_beside(
            ctx, "--stepped", lambda name: name == "speed", "time passes by the command `step` alone"
        )
    at = RobotHost(
        host,
        ports,
        connections,
        speed,
        stepped,
        _dashboard(dashboard, dashboard_programs, local=local_control),
    )
    if scenario is not None:
        _refuse_beside(ctx, "--scenario", lambda name: name not in _ABOUT_THE_PROCESS, "write it in the file")
        return _of_scenario(scenario, at)
    if loop and replay is None:
        raise click.UsageError("--loop needs --replay FILE")
    settings = _settings(**options)
    try:
        if replay is None:
            return plain_robots(settings, at)
        _refuse_beside(ctx, "--replay", lambda name: name in _NOT_REPLAYED, "the recording is the robot")
        return _of_recording(replay, settings, at, loop=loop)
    except ProgramError as error:
        raise MistakeInFileError(str(error)) from error
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--hold, --field, --dashboard") from error


def _dashboard(port: int | None, programs: str | None, *, local: bool) -> DashboardHost | None:
    from gatewayd.simulator.dashboard import DEFAULT_PROGRAMS
    from gatewayd.simulator.fleet import DashboardHost

    if port is None:
        if programs is not None or local:
            raise click.UsageError("--dashboard-programs and --local-control need --dashboard PORT")
        return None
    return DashboardHost(port, DEFAULT_PROGRAMS if programs is None else _fields(programs), local)


def _refuse_beside(ctx: click.Context, option: str, refused: Callable[[str], bool], remedy: str) -> None:
    for parameter in ctx.command.params:
        name = parameter.name or ""
        given = ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
        if given and refused(name):
            raise click.UsageError(f"{parameter.opts[0]} has no meaning beside {option}: {remedy}")


def _of_scenario(path: Path, at: RobotHost) -> Robots:
    from gatewayd.simulator.fleet import scenario_robots
    from gatewayd.simulator.scenario import ScenarioError, read_scenario

    try:
        return scenario_robots(read_scenario(path), at)
    except OSError as error:
        raise click.BadParameter(f"{path}: {error.strerror}", param_hint="--scenario") from error
    except ScenarioError as error:
        raise MistakeInFileError(str(error)) from error
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--port") from error


def _of_recording(path: Path, settings: RobotSettings, at: RobotHost, *, loop: bool) -> Robots:
    from gatewayd.rtde.recording import RecordingError
    from gatewayd.simulator.fleet import replayed_robots

    try:
        return replayed_robots(path, settings, at, repeat=loop)
    except RecordingError as error:
        raise UnreadableRecordingError(str(error)) from error


def _settings(
    *,
    series: str | None,
    version: str | None,
    model: str,
    frequency: float | None,
    uptime: float | None,
    programs: tuple[str, ...],
    program_files: tuple[Path, ...],
    hold: str | None,
    fields: tuple[str, ...],
    unreadable: str | None,
    strict_lists: str | None,
    drop_at: str | None,
    drop_times: int,
    linger: int,
    overflow_close: float,
    **switches: Any,
) -> RobotSettings:
    from gatewayd.simulator.faults import DropAt, LongLists
    from gatewayd.simulator.program import ProgramError
    from gatewayd.simulator.settings import RobotSettings, read_field, read_generation, read_inputs

    with _blamed("--drop-at"):
        step = DropAt.parse(drop_at) if drop_at is not None else None
    with _blamed("--field"):
        own = tuple(read_field(text) for text in fields)
    with _blamed("--unreadable"):
        inputs = read_inputs(_fields(unreadable))
    with _blamed("--version"):
        generation, software = read_generation(series, version)
    try:
        program = tuple(_rules(programs, program_files))
    except ProgramError as error:
        raise MistakeInFileError(str(error)) from error
    faults = {
        "hold": _fields(hold),
        "unreadable": inputs,
        "long_lists": LongLists(strict_lists or "take"),
        "drop_at": step,
        "drop_times": drop_times or math.inf,
        "linger": linger / 1000,
        "overflow_close": None if overflow_close == math.inf else overflow_close,
        **switches,
    }
    return RobotSettings(generation, software, model, frequency, uptime, program, own, faults)


@contextmanager
def _blamed(option: str) -> Iterator[None]:
    """Turn a ValueError into one about this option."""
    try:
        yield
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint=option) from error


def _fields(text: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())


def _rules(programs: tuple[str, ...], files: tuple[Path, ...]) -> list[ProgramRule]:
    """The rules of the options, then those of the files."""
    from gatewayd.simulator.program import DEMO, parse

    rules: list[ProgramRule] = []
    for number, text in enumerate(programs, 1):
        source = "--program" if len(programs) == 1 else f"--program {number}"
        rules += parse(DEMO if text == "demo" else text, source)
    for path in files:
        try:
            text = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
            raise click.BadParameter(f"{path}: {reason}", param_hint="--program-file") from error
        rules += parse(text, str(path))
    return rules
