"""The robot of a test: what its registers hold, and what it reports in each package."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.core.program import NUMBERS

_PROGRAM_FIELD = "runtime_state"


class PlantRobot:
    """Takes what the cell gives it at once, and reports what it is to show. Times are simulated seconds."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._variables = cell.definition.variables
        self._holds: list[Value] = [variable.kind.zero for variable in self._variables]
        """What its registers hold, by variable: inputs as given, outputs as shown."""
        self._program = NUMBERS["playing"]
        self._connected = self._reports = False
        self.run_program(NUMBERS["playing"])
        cell.listeners.append(self._take)

    def connect(self, now: float) -> None:
        """Begin a session, or begin to report again in the one there is."""
        if not self._connected:
            self._cell.robot_connected(now)
        self._connected = self._reports = True
        self.report(now)

    def fall_silent(self) -> None:
        """Send no more packages; the connection stays."""
        self._reports = False

    def lose(self, now: float) -> None:
        """The connection ends; the registers keep what they hold."""
        self._connected = self._reports = False
        self._cell.robot_lost("connection lost", now)

    def restart(self, now: float) -> None:
        """The controller starts anew: its registers are zero, no program runs, and it connects."""
        self.lose(now)
        self._holds = [variable.kind.zero for variable in self._variables]
        self.run_program(NUMBERS["stopped"])
        self.connect(now)

    def show(self, values: Mapping[int, Value], now: float) -> None:
        """Have these outputs from now on; the next package says so, at once."""
        for index, value in values.items():
            self._holds[index] = typed(self._variables[index], value)
            if self._variables[index].field == _PROGRAM_FIELD:
                self._program = int(value)
        self.report(now)

    def run_program(self, state: int) -> None:
        """The robot program is in this `runtime_state` from now on."""
        self._program = state
        for index, variable in enumerate(self._variables):
            if variable.field == _PROGRAM_FIELD:
                self._holds[index] = state

    def give(self, indices: Iterable[int], *, available: bool, now: float) -> None:
        """The registers of these variables are given to the cell, or to another client."""
        fields = {(self._variables[index].field, self._variables[index].direction) for index in indices}
        same = [
            index
            for index, variable in enumerate(self._variables)
            if (variable.field, variable.direction) in fields
        ]
        self._cell.set_availability(same, available, "" if available else "in use by another client", now)
        if available and self._cell.accepts_writes:
            self._cell.adopt(self._inputs(same), now)
        self.report(now)

    def report(self, now: float) -> None:
        """Send a package, if it sends any."""
        if not self._reports:
            return
        cell, image = self._cell, self._cell.image
        # Without a timestamp of the controller: packages of one moment are news too.
        if not cell.package_arrived(None, now):
            return
        for index in image.packaged:
            if image.available[index]:
                image.values[index] = self._holds[index]
        cell.program(self._program)
        cell.outputs_written(now)
        apart = [index for index in image.outputs if self._variables[index].via]
        cell.carried.report({index: self._holds[index] for index in apart}, now)
        if not cell.accepts_writes:
            cell.adopt(self._inputs(image.inputs), now)
        for index in tuple(cell.delivery.under_way):
            cell.delivery.delivered(index)

    def _inputs(self, indices: Iterable[int]) -> dict[int, Value]:
        variables, available = self._variables, self._cell.image.available
        return {
            index: self._holds[index]
            for index in indices
            if variables[index].direction is Direction.INPUT and available[index]
            if not variables[index].is_command
        }

    def _take(self, direction: Direction) -> None:
        """The cell may have something to give."""
        if direction is Direction.OUTPUT:
            return
        delivery, image = self._cell.delivery, self._cell.image
        delivery.take_releases()
        for index in image.inputs:
            if delivery.is_given(index) and image.available[index]:
                self._holds[index] = image.values[index]


_CASTS: Final[dict[ValueKind, Callable[[Value], Value]]] = {
    ValueKind.BOOL: bool,
    ValueKind.INT: int,
    ValueKind.FLOAT: float,
}


def typed(variable: Variable, value: Value) -> Value:
    """A value of a test as the variable has it; a number that is no whole one stays, so that it can be refused."""
    if variable.kind is ValueKind.INT and value != int(value):
        return value
    return _CASTS[variable.kind](value)
