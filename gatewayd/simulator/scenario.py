'''Scenario files: which robots there are, and what happens to each of them when.

    [robots.left]                  a robot and its name; each has its own state and port
    port = 30004
    series = "e"
    start = """
    power off
    """
    timeline = """
    2.0   power on                 seconds since the start, and a control command
    5.5   power release
    """

The format is TOML, because the standard library reads it, so that neither the simulator nor those who test with it
needs another package; because it has types, comments and strings of several lines, and editors know it; and because a
key that is there twice is an error. What happens is written in the commands that standard input takes as well: there is
one language to learn, and what was tried by hand can be copied into a file.
'''

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from gatewayd.simulator.program import ProgramError, ProgramRule, parse
from gatewayd.simulator.scenario_keys import FAULT_ATTRIBUTES, FAULT_KEYS, ROBOT_KEYS
from gatewayd.simulator.settings import RobotSettings, read_generation, read_seconds
from gatewayd.simulator.toml_lines import line_of, text_lines

MAX_SIZE = 1 << 20
"""Bytes of a file."""
MAX_ROBOTS = 32
"""Robots of a file."""
MAX_ENTRIES = 10_000
"""Lines of `start` or `timeline` of one robot."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,31}")
_COMMENT = re.compile(r"(?:^|\s)#.*")
_PLACE = re.compile(r" \(at line (\d+), column (\d+)\)$")


class ScenarioError(ValueError):
    """A scenario that cannot be played: `FILE:LINE: what is wrong, and what to do`."""

    def __init__(self, file: str, line: int, message: str) -> None:
        super().__init__(f"{file}:{line}: {message}")
        self.file = file
        self.line = line


@dataclass(frozen=True, slots=True)
class ScenarioEntry:
    """A command and when it is due, in seconds since the start."""

    at: float
    command: str
    line: int


@dataclass(frozen=True, slots=True)
class ScenarioRobot:
    """One robot of a scenario."""

    name: str
    line: int
    settings: RobotSettings
    program_lines: tuple[int, ...] = ()
    """Where each line of the robot program stands."""
    port: int | None = None
    start: tuple[ScenarioEntry, ...] = ()
    """What has happened before anybody can connect, and again after each restart."""
    timeline: tuple[ScenarioEntry, ...] = ()
    """In the order of their times."""
    begin: str = "start"
    """From when the timeline counts: the `start` of the robot, or the first `client` that starts its outputs."""
    repeat: float | None = None
    """Seconds after which the timeline begins again."""

    def program_line(self, number: int) -> int:
        """The line of the file that has line `number` of the robot program."""
        return self.program_lines[min(number, len(self.program_lines)) - 1]


@dataclass(frozen=True, slots=True)
class Scenario:
    """A file that was read."""

    file: str
    robots: tuple[ScenarioRobot, ...]


def read_scenario(path: str | Path) -> Scenario:
    """Read a file. OSError if it cannot be read, ScenarioError for the first mistake in it."""
    with Path(path).open("rb") as file:
        return parse_scenario(file.read(MAX_SIZE + 1), str(path))


def parse_scenario(data: bytes, file: str) -> Scenario:
    """The scenario of a file's content; `file` names it in a ScenarioError."""
    if len(data) > MAX_SIZE:
        raise ScenarioError(file, 1, f"larger than {MAX_SIZE} bytes; split the scenario")
    try:
        text = data.decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(file, line, "is not UTF-8 text; save it as UTF-8") from None
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        place = _PLACE.search(str(error))
        line = int(place[1]) if place else text.count("\n") + 1
        reason = _PLACE.sub("", str(error)) if isinstance(error, ValueError) else "nested too deeply"
        raise ScenarioError(file, line, f"no TOML: {reason}") from None
    return Scenario(file, tuple(_Reader(file, text).robots(document)))


class _Reader:
    """Turns a document into robots; knows where a mistake stands."""

    def __init__(self, file: str, text: str) -> None:
        self._file = file
        self._text = text

    def robots(self, document: Mapping[str, Any]) -> Iterator[ScenarioRobot]:
        self._check_keys((), document, ["robots"])
        robots = document.get("robots")
        if not isinstance(robots, dict) or not robots:
            raise ScenarioError(self._file, 1, "no robot; begin with a line [robots.NAME]")
        if len(robots) > MAX_ROBOTS:
            raise ScenarioError(self._file, 1, f"{len(robots)} robots; a file has {MAX_ROBOTS} at most")
        ports: dict[int, str] = {}
        for name, table in robots.items():
            path = ("robots", name)
            if not _NAME.fullmatch(name):
                raise self._error(path, f"{name!r} is no name; take letters, digits, - and _ (32 at most)")
            if not isinstance(table, dict):
                raise self._error(path, f"{name!r} is no table; write [robots.{name}]")
            robot = self._robot(path, name, table)
            if robot.port and ports.setdefault(robot.port, name) != name:
                message = (
                    f"port {robot.port} is that of {ports[robot.port]!r} as well; each robot needs its own"
                )
                raise self._error((*path, "port"), message)
            yield robot

    def _robot(self, path: tuple[str, ...], name: str, table: Mapping[str, Any]) -> ScenarioRobot:
        self._check_keys(path, table, ROBOT_KEYS)
        values = {key: self._value((*path, key), key, table[key], ROBOT_KEYS) for key in table}
        try:
            series, version = read_generation(values.get("series"), values.get("version"))
        except ValueError as error:
            raise self._error((*path, "version"), str(error)) from None
        faults = self._faults((*path, "faults"), values.get("faults", {}))
        lines = text_lines(self._text, (*path, "program")) if values.get("program") else []
        settings = RobotSettings(
            series=series,
            version=version,
            program=self._program(lines),
            faults={**faults, "hold": values.get("hold", ())},
            **{key: values[key] for key in ("model", "frequency", "uptime", "fields") if key in values},
        )
        return ScenarioRobot(
            name,
            line_of(self._text, path),
            settings,
            tuple(line for line, _ in lines),
            values.get("port"),
            start=tuple(self._entries((*path, "start"), timed=False)) if "start" in table else (),
            timeline=tuple(self._entries((*path, "timeline"), timed=True)) if "timeline" in table else (),
            begin=values.get("begin", "start"),
            repeat=values.get("repeat"),
        )

    def _faults(self, path: tuple[str, ...], table: Mapping[str, Any]) -> dict[str, Any]:
        self._check_keys(path, table, FAULT_KEYS)
        values = {key: self._value((*path, key), key, table[key], FAULT_KEYS) for key in table}
        return {FAULT_ATTRIBUTES.get(key, key): value for key, value in values.items()}

    def _program(self, lines: Sequence[tuple[int, str]]) -> tuple[ProgramRule, ...]:
        try:
            return parse("\n".join(text for _, text in lines), self._file)
        except ProgramError as error:
            line = lines[error.line - 1][0]
            raise ScenarioError(self._file, line, str(error).split(": ", 1)[1]) from None

    def _entries(self, path: tuple[str, ...], *, timed: bool) -> Iterator[ScenarioEntry]:
        lines = text_lines(self._text, path)
        if len(lines) > MAX_ENTRIES:
            raise self._error(path, f"more than {MAX_ENTRIES} lines; split the scenario")
        last = 0.0
        for line, text in lines:
            command = _COMMENT.sub("", text).strip()
            if not command:
                continue
            at = 0.0
            if timed:
                word, _, command = command.partition(" ")
                at = self._time(line, word, last)
                last = at
            if not command.strip():
                raise ScenarioError(self._file, line, "a time without a command; write `2.5 power on`")
            yield ScenarioEntry(at, command.strip(), line)

    def _time(self, line: int, word: str, last: float) -> float:
        try:
            at = read_seconds(word.removesuffix("s"))
        except ValueError:
            message = f"{word!r} is no time; a line is seconds and a command: `2.5 power on`"
            raise ScenarioError(self._file, line, message) from None
        if at < last:
            message = f"{at:g} s is before the {last:g} s of the line above; sort the lines by time"
            raise ScenarioError(self._file, line, message)
        return at

    def _value(
        self, path: tuple[str, ...], key: str, value: Any, keys: Mapping[str, Callable[[Any], Any]]
    ) -> Any:
        try:
            return keys[key](value)
        except (ValueError, OverflowError) as error:
            raise self._error(path, f"{key} = {_shown(value)}: {error}") from None

    def _check_keys(self, path: tuple[str, ...], table: Mapping[str, Any], known: Any) -> None:
        for key in table:
            if key not in known:
                near = get_close_matches(key, list(known), 1)
                hint = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(known)}"
                raise self._error((*path, key), f"unknown key {key!r}; {hint}")

    def _error(self, path: tuple[str, ...], message: str) -> ScenarioError:
        return ScenarioError(self._file, line_of(self._text, path), message)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
