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
    freeze on|off                timestamp stands still, packages go on
    creep on|off                 as freeze, but the timestamp goes on by 1 ns a cycle
    silence on|off               no data packages
    pause SECONDS                stand still, as a halted virtual machine: nothing sent, read or counted
    delay SECONDS                packages and answers leave this late; 0: at once
    drop-at STEP[:NUMBER]|off    close the next connection that gets there, see --drop-at
    drop-clients                 cut every connection; ok COUNT
    text MESSAGE                 text message (warning) to every client
    raw HEX                      these bytes, whatever they are, to every client: `raw 000352`
    restart                      boot again: connections, registers and timestamp from the beginning
    clients                      ok COUNT
    quit                         stop the simulator

An answer is `ok`, `ok RESULT` or `error REASON`. Bits are `true` and `false`, as are their values in `set`; a mode or
state may be written as its name: `set robot_mode POWER_OFF`.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterable, Mapping
from enum import IntEnum
from functools import partial

from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.enums import STATES
from gatewayd.rtde.types import INTEGER_RANGES
from gatewayd.simulator.faults import DropAt
from gatewayd.simulator.modes import POWER_COMMANDS, PROGRAM, SAFETY, RobotModes
from gatewayd.simulator.server import SimulatedController
from gatewayd.simulator.store import Scalar

_Command = Callable[[str], str | Awaitable[None] | None]
_WORDS = {"true": True, "false": False, "on": True, "off": False}


class Control:
    """The command interpreter of one simulator."""

    def __init__(self, simulator: SimulatedController) -> None:
        self.quit = False
        """Whether `quit` was asked for."""
        self._simulator = simulator
        self._controller = simulator.controller
        self._commands: Mapping[str, _Command] = {
            "get": self._get,
            "set": self._set,
            "overwrite": self._overwrite,
            "hold": self._hold,
            "free": lambda rest: self._controller.free(_fields(rest)),
            "power": lambda rest: self._modes.switch_power(_choice(rest, POWER_COMMANDS)),
            "program": lambda rest: self._modes.run_program(_choice(rest, PROGRAM)),
            "safety": lambda rest: self._modes.set_safety(_choice(rest, SAFETY)),
            "freeze": partial(self._switch, "freeze"),
            "creep": partial(self._switch, "creep"),
            "silence": partial(self._switch, "silence"),
            "pause": lambda rest: simulator.pause(_seconds(rest)),
            "delay": self._delay,
            "drop-at": self._drop_at,
            "drop-clients": lambda _: str(simulator.drop_clients()),
            "text": simulator.say,
            "raw": lambda rest: simulator.raw(bytes.fromhex(rest)),
            "restart": lambda _: simulator.restart(),
            "clients": lambda _: str(simulator.clients),
            "quit": self._quit,
        }

    @property
    def _modes(self) -> RobotModes:
        return self._controller.modes

    async def execute(self, line: str) -> str:
        """Run one command line and return its answer, without a line end. Never raises for what the line says."""
        name, _, rest = line.strip().partition(" ")
        command = self._commands.get(name)
        if command is None:
            return f"error unknown command {name!r}; there are: {', '.join(self._commands)}"
        try:
            result = command(rest.strip())
            if isinstance(result, Awaitable):
                await result
                result = None
        except (ValueError, OSError) as error:
            return f"error {error}"
        except KeyError as error:
            return f"error {_unknown(str(error.args[0]))}"
        return "ok" if result is None else f"ok {result}"

    def _get(self, rest: str) -> str:
        values = self._controller.get(rest)
        return ",".join(str(value).lower() if isinstance(value, bool) else str(value) for value in values)

    def _hold(self, rest: str) -> None:
        names, _, holder = rest.partition(" by ")
        self._controller.hold(_fields(names), *filter(None, [holder.strip()]))

    def _set(self, rest: str) -> None:
        field, _, text = rest.partition(" ")
        self._controller.set(field, self._values(field, text))

    def _overwrite(self, rest: str) -> None:
        field, _, text = rest.partition(" ")
        self._controller.overwrite(field, None if text.strip() == "off" else self._values(field, text))

    def _switch(self, fault: str, text: str) -> None:
        if text not in ("on", "off"):
            message = f"on or off, not {text!r}"
            raise ValueError(message)
        setattr(self._simulator.faults, fault, text == "on")

    def _delay(self, rest: str) -> None:
        self._simulator.faults.delay = _seconds(rest)

    def _drop_at(self, rest: str) -> None:
        faults = self._simulator.faults
        faults.drop_at = None if rest == "off" else DropAt.parse(rest)
        faults.drop_times = 1

    def _quit(self, _rest: str) -> None:
        self.quit = True

    def _values(self, field: str, text: str) -> list[Scalar]:
        code = self._controller.store.type(field).code
        names = STATES.get(field)
        return [_value(item.strip(), code, names) for item in text.split(",")]


def _fields(text: str) -> list[str]:
    fields = [name.strip() for name in text.split(",") if name.strip()]
    if not fields:
        message = "which field?"
        raise ValueError(message)
    return fields


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0 <= seconds < math.inf:
        message = f"{text!r} is not a number of seconds"
        raise ValueError(message)
    return seconds


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
        return float(text)
    if names is not None and not text.lstrip("-").isdecimal():
        message = f"{text!r} is neither a number nor one of {', '.join(names.__members__)}"
        raise ValueError(message)
    value = int(text, 0)
    low, high = INTEGER_RANGES.get(code, (0, 1))
    if not low <= value <= high:
        message = f"{value} is not within {low}..{high}"
        raise ValueError(message)
    return value


def _unknown(field: str) -> str:
    near = suggest(field)
    return f"no field {field!r}" + (f"; did you mean {' or '.join(near)}?" if near else "")
