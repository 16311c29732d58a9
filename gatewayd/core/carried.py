"""Variables that a link of their own carries: commands that it is given, and outputs that it reports.

The robot's packages know nothing of them. Such a link is there or not, apart from the session of the packages; its
commands can be written while both are there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from gatewayd.core.commands import Commands
from gatewayd.core.definition import Direction, Value
from gatewayd.core.forcing import Forcing
from gatewayd.core.image import ProcessImage


@dataclass(slots=True, eq=False)
class Carried:
    """What the links that carry variables by themselves tell one cell. `via` is the name of such a link."""

    _image: ProcessImage
    _commands: Commands
    _forcing: Forcing
    _set_availability: Callable[[Collection[int], bool, str, float], None]
    _adopt: Callable[[Mapping[int, Value], float], None]
    """Takes over what inputs hold, if the robot is there."""
    _notify: Callable[[Direction], None]

    def commands(self, via: str) -> tuple[int, ...]:
        """Its commands."""
        return tuple(index for index in self._commands.indices if self._image.variables[index].via == via)

    def outputs(self, via: str) -> tuple[int, ...]:
        """What it reports."""
        return tuple(index for index in self._image.outputs if self._image.variables[index].via == via)

    def begin(self, via: str, now: float) -> None:
        """The link has its connection: its commands can be written, once everybody has let go of them."""
        commands = self.commands(via)
        self._commands.disarm(commands)
        self._set_availability(commands, True, "", now)
        self._adopt(self._commands.at_rest(commands), now)

    def end(self, via: str, reason: str, now: float) -> None:
        """The link has no connection: its commands are refused."""
        commands = self.commands(via)
        self._commands.disarm(commands)
        self._set_availability(commands, False, reason, now)

    def report(self, values: Mapping[int, Value], now: float) -> None:
        """What these outputs are now."""
        if values:
            self._forcing.lift()
            self._image.report(values.items(), now)
            self._notify(Direction.OUTPUT)

    def unreported(self, indices: Collection[int]) -> None:
        """What these outputs are is not known any more: they are stale."""
        if indices:
            self._forcing.lift()
            self._image.unreported(tuple(indices))
            self._notify(Direction.OUTPUT)
