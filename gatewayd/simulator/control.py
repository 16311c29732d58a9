"""Commands that switch faults and values while the simulator runs: one line in, one line out.

    get FIELD                    ok VALUE[,VALUE...]
    set FIELD VALUE[,VALUE...]   write as the robot would; a moving field stays there
    overwrite FIELD VALUE[,...]  the same in every cycle, whatever clients send; `overwrite FIELD off` ends it
    hold FIELD[,FIELD...]        claim inputs for the controller itself
    free FIELD[,FIELD...]        give them up again
    freeze on|off                timestamp stands still, packages go on
    creep on|off                 as freeze, but the timestamp goes on by 1 ns a cycle
    silence on|off               no data packages
    pause SECONDS                stand still, as a halted virtual machine: nothing sent, read or counted
    delay SECONDS                packages and answers leave this late; 0: at once
    drop-at STEP[:NUMBER]|off    close the next connection that gets there, see --drop-at
    drop-clients                 cut every connection; ok COUNT
    text MESSAGE                 text message (warning) to every client
    restart                      boot again: connections, registers and timestamp from the beginning
    clients                      ok COUNT
    quit                         stop the simulator

An answer is `ok`, `ok RESULT` or `error REASON`. Bits are `true` and `false`, as are their values in `set`.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Mapping

from gatewayd.rtde.catalogue import suggest
from gatewayd.simulator.faults import DropAt
from gatewayd.simulator.server import SimulatedController
from gatewayd.simulator.store import RANGES, Scalar

__all__ = ["Control"]

_Command = Callable[[str], Awaitable[str | None]]
_WORDS = {"true": True, "false": False, "on": True, "off": False}


class Control:
    """The command interpreter of one simulator."""

    def __init__(self, simulator: SimulatedController) -> None:
        self.quit = False
        """Whether the simulator was told to stop."""
        self._simulator = simulator
        self._commands: Mapping[str, _Command] = {
            "get": self._get,
            "set": self._set,
            "overwrite": self._overwrite,
            "hold": self._hold,
            "free": self._free,
            "freeze": self._freeze,
            "creep": self._creep,
            "silence": self._silence,
            "pause": self._pause,
            "delay": self._delay,
            "drop-at": self._drop_at,
            "drop-clients": self._drop_clients,
            "text": self._text,
            "restart": self._restart,
            "clients": self._clients,
            "quit": self._quit,
        }

    async def execute(self, line: str) -> str:
        """Run one command line and return its answer, without a line end. Never raises for what the line says."""
        name, _, rest = line.strip().partition(" ")
        command = self._commands.get(name)
        if command is None:
            return f"error unknown command {name!r}; there are: {', '.join(self._commands)}"
        try:
            result = await command(rest.strip())
        except (ValueError, OSError) as error:
            return f"error {error}"
        except KeyError as error:
            return f"error {_unknown(str(error.args[0]))}"
        return "ok" if result is None else f"ok {result}"

    async def _get(self, rest: str) -> str:
        return ",".join(
            str(v).lower() if isinstance(v, bool) else str(v) for v in self._simulator.controller.get(rest)
        )

    async def _set(self, rest: str) -> None:
        field, _, text = rest.partition(" ")
        self._simulator.set(field, *self._values(field, text))

    async def _overwrite(self, rest: str) -> None:
        field, _, text = rest.partition(" ")
        self._simulator.overwrite(field, *(() if text.strip() == "off" else self._values(field, text)))

    def _values(self, field: str, text: str) -> list[Scalar]:
        code = self._simulator.controller.store.type(field).code
        return [_value(item.strip(), code) for item in text.split(",")]

    async def _hold(self, rest: str) -> None:
        self._simulator.hold(*_fields(rest))

    async def _free(self, rest: str) -> None:
        self._simulator.free(*_fields(rest))

    async def _freeze(self, rest: str) -> None:
        self._simulator.faults.freeze = _switch(rest)

    async def _silence(self, rest: str) -> None:
        self._simulator.faults.silence = _switch(rest)

    async def _creep(self, rest: str) -> None:
        self._simulator.faults.creep = _switch(rest)

    async def _pause(self, rest: str) -> None:
        self._simulator.pause(_seconds(rest))

    async def _delay(self, rest: str) -> None:
        self._simulator.faults.delay = _seconds(rest)

    async def _drop_at(self, rest: str) -> None:
        faults = self._simulator.faults
        faults.drop_at = None if rest == "off" else DropAt.parse(rest)
        faults.drop_times = 1

    async def _drop_clients(self, _rest: str) -> str:
        return str(self._simulator.drop_clients())

    async def _text(self, rest: str) -> None:
        self._simulator.say(rest)

    async def _restart(self, _rest: str) -> None:
        await self._simulator.restart()

    async def _clients(self, _rest: str) -> str:
        return str(self._simulator.clients)

    async def _quit(self, _rest: str) -> None:
        self.quit = True


def _fields(text: str) -> list[str]:
    fields = [name.strip() for name in text.split(",") if name.strip()]
    if not fields:
        message = "which field?"
        raise ValueError(message)
    return fields


def _switch(text: str) -> bool:
    if text not in ("on", "off"):
        message = f"on or off, not {text!r}"
        raise ValueError(message)
    return text == "on"


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0 <= seconds < math.inf:
        message = f"{text!r} is not a number of seconds"
        raise ValueError(message)
    return seconds


def _value(text: str, code: str) -> Scalar:
    """A number that an element of format `code` can hold."""
    if text in _WORDS:
        return _WORDS[text]
    if code == "d":
        return float(text)
    value = int(text, 0)
    least, greatest = RANGES.get(code, (0, 1))
    if not least <= value <= greatest:
        message = f"{value} is not within {least}..{greatest}"
        raise ValueError(message)
    return value


def _unknown(field: str) -> str:
    near = suggest(field)
    return f"no field {field!r}" + (f"; did you mean {' or '.join(near)}?" if near else "")
