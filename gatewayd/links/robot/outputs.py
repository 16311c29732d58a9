"""What the packages of one session bring into the image of a cell."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value, Variable
from gatewayd.core.freshness import Source
from gatewayd.links.robot.transfer import OutputTransfer
from gatewayd.rtde.session import TIMESTAMP

_PROGRAM = "runtime_state"


class SessionOutputs:
    """The outputs of a session, `without` some variables. Packages are flat, fields lie in them where `slots` says.

    Times are of the loop's clock (`now`) and of one that nobody adjusts (`raw`).
    """

    __slots__ = ("_program", "_timestamp", "_transfer", "slots")

    def __init__(
        self,
        variables: Sequence[Variable] = (),
        slots: Mapping[str, slice] | None = None,
        without: Container[int] = (),
    ) -> None:
        self.slots: dict[str, slice] = dict(slots or {})
        self._transfer = OutputTransfer(variables, self.slots, without)
        self._timestamp = self._place(TIMESTAMP)
        self._program = self._place(_PROGRAM)

    def show(self, cell: Cell, flat: Sequence[Value], now: float, raw: float) -> bool:
        """Put a package into the image, if it reports anything to be shown; whether it does."""
        if cell.freshness.state is not Source.FRESH:
            self._transfer.forget()
        timestamp = float(flat[self._timestamp]) if self._timestamp is not None else None
        if not cell.package_arrived(timestamp, now, raw):
            return False
        self._transfer.copy(flat, cell.image.values)
        cell.program(int(flat[self._program]) if self._program is not None else None)
        cell.outputs_written(now)
        return True

    def show_earlier(self, cell: Cell, flat: Sequence[Value], now: float, raw: float) -> bool:
        """Have a package that waited together with newer ones pass through the image, so that its pulses count.

        It has its own time, and makes the source neither fresh nor late: what is as old as that is not shown.
        """
        if self._timestamp is None or cell.freshness.state is not Source.FRESH:
            return False
        if cell.lag.of(float(flat[self._timestamp]), raw) > cell.freshness.stale_after:
            return False
        return self.show(cell, flat, now, raw)

    def _place(self, field: str) -> int | None:
        return self.slots[field].start if field in self.slots else None
