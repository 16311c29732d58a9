"""Simulated robots for tests that block: in a thread of the test's process, or in a process of their own.

Whatever is asked of a robot goes through the control commands, so both are the same for the test, and everything that
can be done by hand can be done in a test: `robot.do("safety protective-stop")`.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from gatewayd.simulator.control import RobotControls
from gatewayd.simulator.double_process import ProcessBackend
from gatewayd.simulator.fleet import RobotHost, Robots, replayed_robots, scenario_robots
from gatewayd.simulator.scenario import parse_scenario
from gatewayd.simulator.settings import RobotSettings
from gatewayd.simulator.store import Scalar

_PATIENCE = 30.0  # seconds for which start and end may take
_LOOK = 0.005  # seconds between two looks at a field that is waited for


class RobotCommandError(Exception):
    """A command that the simulated robot refuses, and why."""


class _Backend(Protocol):
    """Where the robots run."""

    ports: dict[str, int]

    def execute(self, line: str) -> str: ...

    def close(self) -> None: ...


class RobotHandle:
    """One running robot. Every method blocks until it is done; RobotCommandError says what the robot refuses."""

    def __init__(self, backend: _Backend, name: str, host: str) -> None:
        self.name = name
        """Its name in the scenario; `robot` without one."""
        self.host = host
        """The address on which it listens."""
        self.port = backend.ports[name]
        """Its TCP port."""
        self.faults = RobotFaults(self.do)
        """What can be made to go wrong."""
        self._backend = backend

    def do(self, command: str) -> str:
        """Carry out a control command (docs/reference/simulator.md); its result, empty if it has none."""
        answer = self._backend.execute(f"{self.name}: {command}")
        word, _, result = answer.partition(" ")
        if word != "ok":
            message = f"{command}: {result}"
            raise RobotCommandError(message)
        return result

    def get(self, field: str) -> Any:
        """A field now, input or output: bool, int or float, a tuple of them for a vector."""
        values = [_scalar(text) for text in self.do(f"get {field}").split(",")]
        return values[0] if len(values) == 1 else tuple(values)

    def set(self, field: str, *values: Scalar | str) -> None:
        """Write a field as the robot would: a value, one for each element, or the name of a state (`"PAUSED"`)."""
        self.do(f"set {field} {_shown(values)}")

    def overwrite(self, field: str, *values: Scalar | str) -> None:
        """Write a field again in every cycle, whatever clients send; without values: no more."""
        self.do(f"overwrite {field} {_shown(values) if values else 'off'}")

    def hold(self, *fields: str, by: str | None = None) -> None:
        """Claim inputs for the controller itself, or for another client of that name: they are IN_USE."""
        self.do(f"hold {','.join(fields)}" + (f" by {by}" if by else ""))

    def free(self, *fields: str) -> None:
        """Give up inputs that are held."""
        self.do(f"free {','.join(fields)}")

    def power(self, command: str) -> None:
        """`on`, `off` or `release` (the brakes), through all modes in between."""
        self.do(f"power {command}")

    def program(self, command: str) -> None:
        """`play`, `pause` or `stop` the robot program."""
        self.do(f"program {command}")

    def safety(self, condition: str) -> None:
        """Enter a condition of the safety system: `protective-stop`, `robot-emergency-stop`, `normal`, ..."""
        self.do(f"safety {condition}")

    def step(self, cycles: int = 1) -> int:
        """Let control cycles pass where time is stepped; returns the number of the last.

        Clients in this thread cannot read meanwhile; in an asyncio test use `step_async`.
        """
        return int(self.do(f"step {cycles}"))

    async def step_async(self, cycles: int = 1) -> int:
        """As `step`, while this event loop goes on."""
        return await asyncio.to_thread(self.step, cycles)

    def wait_for(self, field: str, wanted: Any, timeout: float = 5.0) -> Any:
        """Wait until a field has a value, or fulfils a condition that is a function; returns it.

        TimeoutError says what the field holds instead. For inputs that a client writes.
        """
        condition: Callable[[Any], bool] = wanted if callable(wanted) else lambda value: bool(value == wanted)
        pause = threading.Event()
        for _ in range(max(1, round(timeout / _LOOK))):
            value = self.get(field)
            if condition(value):
                return value
            pause.wait(_LOOK)
        message = f"{field} is {value!r} after {timeout:g} s"
        raise TimeoutError(message)

    @property
    def clients(self) -> int:
        """Clients connected now."""
        return int(self.do("clients"))

    def restart(self) -> None:
        """Boot again: connections closed, registers and timestamp from the beginning."""
        self.do("restart")


class RobotFaults:
    """The faults of one robot that can be thrown while it runs; others stand in the scenario."""

    def __init__(self, do: Callable[[str], str]) -> None:
        self._do = do

    def freeze(self, *, on: bool = True) -> None:
        """The timestamp stands still, packages go on."""
        self._do(f"freeze {_switch(on)}")

    def creep(self, *, on: bool = True) -> None:
        """As `freeze`, but the timestamp goes on by 1 ns a cycle."""
        self._do(f"creep {_switch(on)}")

    def silence(self, *, on: bool = True) -> None:
        """No data packages; everything else is answered."""
        self._do(f"silence {_switch(on)}")

    def pause(self, seconds: float) -> None:
        """Stand still, as a halted virtual machine."""
        self._do(f"pause {seconds!r}")

    def delay(self, seconds: float) -> None:
        """Packages and answers leave this late; 0: at once."""
        self._do(f"delay {seconds!r}")

    def drop_at(self, step: str | None) -> None:
        """Close the next connection that gets to a step, `outputs` or `data:10` say; None: no more."""
        self._do(f"drop-at {step or 'off'}")

    def drop_clients(self) -> int:
        """Cut every connection; returns how many there were."""
        return int(self._do("drop-clients"))

    def text(self, message: str) -> None:
        """Send a text message (a warning) to every client."""
        self._do(f"text {message}")

    def raw(self, data: bytes) -> None:
        """Send these bytes, whatever they are, to every client."""
        self._do(f"raw {data.hex()}")


class SimulatedRobot(RobotHandle):
    """A running simulated robot, or the first of several; a context manager, or `close`.

    `scenario` is a file or, where it has several lines, its content; without one `keys` are those of a robot's table in
    a scenario file: `SimulatedRobot(series="cb3", hold=["input_int_register_3"], faults={"delay": 0.1})`. `replay` is a
    recording, played once or in a `loop`. `stepped`: time passes by `step` alone, else at `speed`. `process`: in a
    process of its own, which goes on whatever holds this one up.

    OSError if the port cannot be had or a file cannot be read, ScenarioError and RecordingError for a mistake in it.
    """

    def __init__(
        self,
        scenario: str | Path | None = None,
        *,
        replay: str | Path | None = None,
        loop: bool = False,
        stepped: bool = False,
        speed: float = 1.0,
        process: bool = False,
        host: str = "127.0.0.1",
        port: int = 0,
        **keys: Any,
    ) -> None:
        if sum((scenario is not None, replay is not None, bool(keys))) > 1:
            message = "a scenario, a recording or keys of a robot: one of them describes the robot"
            raise TypeError(message)
        text, file = _scenario(scenario, keys)
        at = RobotHost(host, (port,), speed=speed, stepped=stepped)
        if replay is None:
            robots = scenario_robots(parse_scenario(text.encode(), file), at)
        else:
            robots = replayed_robots(replay, RobotSettings(), at, repeat=loop)
        backend: _Backend = (
            ProcessBackend(list(robots), text, at, replay, repeat=loop) if process else _ThreadBackend(robots)
        )
        super().__init__(backend, next(iter(backend.ports)), host)
        self.robots: Mapping[str, RobotHandle] = {
            name: self if name == self.name else RobotHandle(backend, name, host) for name in backend.ports
        }
        """All robots by name, this one among them."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop all robots; a second time does nothing."""
        self._backend.close()


class _ThreadBackend:
    """An event loop in a thread, with the robots."""

    def __init__(self, robots: Robots) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="simulated robots", daemon=True)
        self._thread.start()
        self._robots = robots
        try:
            self._wait(_each(robot.start for robot in self._robots.values()))
        except BaseException:
            self.close()
            raise
        self._controls = RobotControls(self._robots)
        self.ports = {name: robot.port for name, robot in self._robots.items()}

    def execute(self, line: str) -> str:
        return str(self._wait(self._controls.execute(line), None))

    def close(self) -> None:
        if self._loop.is_closed():
            return
        self._wait(_each(robot.stop for robot in self._robots.values()))
        self._wait(_others())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _wait(self, work: Coroutine[Any, Any, object], patience: float | None = _PATIENCE) -> object:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(patience)


async def _each(calls: Iterable[Callable[[], Awaitable[None]]]) -> None:
    for call in calls:
        await call()


async def _others() -> None:
    """Returns when all other tasks have ended: also those of a client that was accepted just before the end."""
    while others := asyncio.all_tasks() - {asyncio.current_task()}:
        await asyncio.wait(others)
    await asyncio.sleep(0)  # lets the transports of those close


def _scenario(scenario: str | Path | None, keys: Mapping[str, Any]) -> tuple[str, str]:
    """The content of the scenario, and what errors call it."""
    if isinstance(scenario, str) and "\n" in scenario:
        return scenario, "scenario"
    if scenario is not None:
        return Path(scenario).read_text("utf-8"), str(scenario)
    lines = "".join(f"{key} = {_toml(value)}\n" for key, value in keys.items())
    return f"[robots.robot]\n{lines}", "SimulatedRobot(...)"


def _toml(value: Any) -> str:
    """A value of a key: JSON is TOML but for tables."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + "}"
    return json.dumps(list(value) if isinstance(value, tuple | set | frozenset) else value)


def _scalar(text: str) -> Scalar:
    if text in ("true", "false"):
        return text == "true"
    try:
        return int(text)
    except ValueError:
        return float(text)


def _shown(values: Iterable[Scalar | str]) -> str:
    return ",".join(str(value).lower() if isinstance(value, bool) else str(value) for value in values)


def _switch(on: bool) -> str:
    return "on" if on else "off"
