"""Commands that switch faults and values while the simulator runs: one line in, one line out.

    get FIELD                    ok VALUE[,VALUE...]
    set FIELD VALUE[,VALUE...]   write as the robot would; a moving field stays there
    overwrite FIELD VALUE[,...]  the same in every cycle, whatever clients send; `overwrite FIELD off` ends it
    hold FIELD[,...] [by NAME]   claim inputs for the controller itself, or for another client of that name
    free FIELD[,FIELD...]        give them up again
    power on|off|release         switch the arm on or off, or release its brakes, through all modes in between
    program play|pause|stop      start, pause or end the robot program; the arm brakes
    safety CONDITION             normal, reduced, protective-stop, safeguard-stop, recovery, robot-emergency-stop,
                                 system-emergency-stop, violation or fault; program and power follow
    remote on|off                remote or local control, as the pendant chooses it (e-Series with --dashboard)
    load NAME|none               load a program, as the pendant does (--dashboard)
    freeze on|off                timestamp stands still, packages go on
    creep on|off                 as freeze, but the timestamp goes on by 1 ns a cycle
    silence on|off               no data packages
    pause SECONDS                stand still, as a halted virtual machine: nothing sent, read or counted
    delay SECONDS                packages and answers leave this late; 0: at once
    drop-at STEP[:NUMBER]|off    close the next connection that gets there, see --drop-at
    drop-clients                 cut every connection; ok COUNT
    drop-dashboard               cut every connection of the dashboard server; ok COUNT
    text MESSAGE                 text message (warning) to every client
    raw HEX                      these bytes, whatever they are, to every client: `raw 000352`
    restart                      boot again: connections, registers and timestamp from the beginning
    clients                      ok COUNT
    step [CYCLES]                let control cycles pass where time is stepped (--stepped); ok CYCLE
    quit                         stop the simulator

An answer is `ok`, `ok RESULT` or `error REASON`. Bits are `true` and `false`, as are their values in `set`; a mode or
state may be written as its name: `set robot_mode POWER_OFF`. Where there are several robots, a line begins with the
name of one: `left: power on`.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterable, Mapping
from enum import IntEnum
from functools import partial
from typing import TypeVar

from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.enums import STATES
from gatewayd.rtde.types import INTEGER_RANGES
from gatewayd.simulator.dashboard_server import DashboardServer
from gatewayd.simulator.faults import DropAt
from gatewayd.simulator.modes import POWER_COMMANDS, PROGRAM, SAFETY
from gatewayd.simulator.server import NOT_STEPPED, SimulatedController
from gatewayd.simulator.store import Scalar

Action = Callable[[], str | Awaitable[str | None] | None]
"""What a command does, once it has been read."""

MAX_STEPS = 1_000_000
"""Cycles of one `step`."""

_Number = TypeVar("_Number", int, float)
_WORDS = {"true": True, "false": False, "on": True, "off": False}


class Control:
    """The command interpreter of one simulator."""

    def __init__(self, simulator: SimulatedController) -> None:
        self.quit = False
        """Whether `quit` was asked for."""
        self._simulator = simulator
        self._controller = simulator.controller
        self._commands: Mapping[str, Callable[[str], Action]] = {
            "get": self._get,
            "set": self._set,
            "overwrite": self._overwrite,
            "hold": self._hold,
            "free": self._free,
            "power": self._power,
            "program": self._program,
            "safety": self._safety,
            "remote": self._remote,
            "load": self._load,
            "freeze": partial(self._switch, "freeze"),
            "creep": partial(self._switch, "creep"),
            "silence": partial(self._switch, "silence"),
            "pause": self._pause,
            "delay": self._delay,
            "drop-at": self._drop_at,
            "drop-clients": lambda _: lambda: str(simulator.drop_clients()),
            "drop-dashboard": lambda _: lambda: str(self._dashboard().drop_clients()),
            "text": lambda text: lambda: simulator.say(text),
            "raw": self._raw,
            "restart": lambda _: simulator.restart,
            "clients": lambda _: lambda: str(simulator.clients),
            "step": self._step,
            "quit": lambda _: self._quit,
        }

    async def execute(self, line: str) -> str:
        """Run one command line and return its answer, without a line end. Never raises for what the line says."""
        try:
            result = self.prepare(line)()
            if isinstance(result, Awaitable):
                result = await result
        except (ValueError, OSError) as error:
            return f"error {error}"
        return "ok" if result is None else f"ok {result}"

    def prepare(self, line: str) -> Action:
        """Read a command line without doing anything; ValueError says what is wrong with it.

        What it does may still raise a ValueError: for a mode in which the robot does not take the command, say.
        """
        name, _, rest = line.strip().partition(" ")
        command = self._commands.get(name)
        if command is None:
            message = f"unknown command {name!r}; there are: {', '.join(self._commands)}"
            raise ValueError(message)
        return command(rest.strip())

    def _get(self, rest: str) -> Action:
        self._known(rest)
        return lambda: _shown(self._controller.get(rest))

    def _set(self, rest: str) -> Action:
        field, _, text = rest.partition(" ")
        values = self._values(field, text)
        return lambda: self._controller.set(field, values)

    def _overwrite(self, rest: str) -> Action:
        field, _, text = rest.partition(" ")
        self._known(field)
        values = None if text.strip() == "off" else self._values(field, text)
        return lambda: self._controller.overwrite(field, values)

    def _hold(self, rest: str) -> Action:
        names, _, holder = rest.partition(" by ")
        fields, by = self._inputs(names), list(filter(None, [holder.strip()]))
        return lambda: self._controller.hold(fields, *by)

    def _free(self, rest: str) -> Action:
        fields = self._inputs(rest)
        return lambda: self._controller.free(fields)

    def _power(self, rest: str) -> Action:
        word = _choice(rest, POWER_COMMANDS)
        return lambda: self._controller.modes.switch_power(word)

    def _program(self, rest: str) -> Action:
        word = _choice(rest, PROGRAM)
        return lambda: self._controller.modes.run_program(word)

    def _safety(self, rest: str) -> Action:
        word = _choice(rest, SAFETY)
        return lambda: self._controller.modes.set_safety(word)

    def _remote(self, text: str) -> Action:
        polyscope = self._dashboard().polyscope
        if not polyscope.knows_local_control:
            raise ValueError("a CB3 controller knows no local control")
        on = _choice(text, ("on", "off")) == "on"
        return lambda: setattr(polyscope, "remote", on)

    def _load(self, rest: str) -> Action:
        polyscope = self._dashboard().polyscope
        name = _choice(rest, ("none", *polyscope.programs))
        return lambda: setattr(polyscope, "loaded", None if name == "none" else name)

    def _dashboard(self) -> DashboardServer:
        if self._simulator.dashboard is None:
            raise ValueError("it has no dashboard server; start it with --dashboard")
        return self._simulator.dashboard

    def _switch(self, fault: str, text: str) -> Action:
        if text not in ("on", "off"):
            message = f"on or off, not {text!r}"
            raise ValueError(message)
        return lambda: setattr(self._simulator.faults, fault, text == "on")

    def _pause(self, rest: str) -> Action:
        seconds = _seconds(rest)
        return lambda: self._simulator.pause(seconds)

    def _delay(self, rest: str) -> Action:
        seconds = _seconds(rest)
        return lambda: setattr(self._simulator.faults, "delay", seconds)

    def _drop_at(self, rest: str) -> Action:
        step = None if rest == "off" else DropAt.parse(rest)

        def act() -> None:
            self._simulator.faults.drop_at = step
            self._simulator.faults.drop_times = 1

        return act

    def _raw(self, rest: str) -> Action:
        try:
            data = bytes.fromhex(rest)
        except ValueError:
            message = f"{rest!r} is not bytes as pairs of hexadecimal digits"
            raise ValueError(message) from None
        return lambda: self._simulator.raw(data)

    def _step(self, rest: str) -> Action:
        if not self._simulator.stepped:
            raise ValueError(NOT_STEPPED)
        cycles = int(rest or "1") if (rest or "1").isdecimal() else 0
        if not 0 < cycles <= MAX_STEPS:
            message = f"{rest!r} is not a number of cycles within 1..{MAX_STEPS}"
            raise ValueError(message)

        async def act() -> str:
            await self._simulator.step(cycles)
            return str(self._controller.cycle)

        return act

    def _quit(self) -> None:
        self.quit = True

    def _known(self, field: str) -> None:
        if field not in self._controller.store:
            near = suggest(field)
            hint = f"; did you mean {' or '.join(near)}?" if near else ""
            message = f"no field {field!r}{hint}"
            raise ValueError(message)

    def _inputs(self, text: str) -> list[str]:
        fields = _fields(text)
        unknown = [name for name in fields if self._controller.input_type(name) is None]
        if unknown:
            message = f"no such input: {', '.join(unknown)}"
            raise ValueError(message)
        return fields

    def _values(self, field: str, text: str) -> list[Scalar]:
        self._known(field)
        kind, names = self._controller.store.type(field), STATES.get(field)
        values = [_value(item.strip(), kind.code, names) for item in text.split(",")]
        self._controller.check(field, values)
        return values


class RobotControls:
    """The commands of several simulators: `NAME: COMMAND`. A single one needs no name."""

    def __init__(self, simulators: Mapping[str, SimulatedController]) -> None:
        self._controls = {name: Control(simulator) for name, simulator in simulators.items()}

    @property
    def quit(self) -> bool:
        """Whether one of them was told to quit."""
        return any(control.quit for control in self._controls.values())

    async def execute(self, line: str) -> str:
        """Run one command line; see `Control.execute`."""
        first, *others = self._controls.values()
        name, colon, rest = line.strip().partition(":")
        if colon and name in self._controls:
            return await self._controls[name].execute(rest)
        if not others or line.strip() == "quit":
            return await first.execute(line)
        return f"error which robot? Begin with {' or '.join(f'{name}:' for name in self._controls)}"


def _shown(values: Iterable[Scalar]) -> str:
    return ",".join(str(value).lower() if isinstance(value, bool) else str(value) for value in values)


def _fields(text: str) -> list[str]:
    fields = [name.strip() for name in text.split(",") if name.strip()]
    if not fields:
        message = "which field?"
        raise ValueError(message)
    return fields


def _seconds(text: str) -> float:
    seconds = _number(text, float)
    if not 0 <= seconds < math.inf:
        message = f"{text!r} is not a number of seconds"
        raise ValueError(message)
    return seconds


def _whole(text: str) -> int:
    """A whole number, also `0x1f`, `0b1`."""
    return int(text, 0)


def _number(text: str, kind: Callable[[str], _Number]) -> _Number:
    try:
        return kind(text)
    except ValueError:
        message = f"{text!r} is not a number"
        raise ValueError(message) from None


def _choice(text: str, words: Iterable[str]) -> str:
    if text not in words:
        message = f"{text!r} is not one of {', '.join(words)}"
        raise ValueError(message)
    return text


def _value(text: str, code: str, names: type[IntEnum] | None) -> Scalar:
    """A number that an element of format `code` can hold, or one of `names`."""
    if text in _WORDS:
        return _WORDS[text]
    if names is not None and text in names.__members__:
        return names[text]
    if code == "d":
        return _number(text, float)
    if names is not None and not text.lstrip("-").isdecimal():
        message = f"{text!r} is neither a number nor one of {', '.join(names.__members__)}"
        raise ValueError(message)
    value = _number(text, _whole)
    low, high = INTEGER_RANGES.get(code, (0, 1))
    if not low <= value <= high:
        message = f"{value} is not within {low}..{high}"
        raise ValueError(message)
    return value
