"""From the robot's outputs to a device: on change, and again every so often where the mapping says so.

| moment | what is written |
|---|---|
| the device is there, and the robot was not fresh since | nothing |
| the robot is fresh, and the device is there: the first value | nothing (`on_connect: wait`), or the value \
(`on_connect: write`) |
| the value changes, by the robot, by a force or because the robot is stale (`on_stale`: a value) | the new value |
| the robot is stale, `on_stale: hold` | nothing new; what is repeated goes on |
| the robot is stale, `on_stale: exception` | nothing, and nothing is repeated |
| `every` has passed since the last write | the value again, once there was a first write |
| the connection broke, and is there again before the device was lost | as if it came, with `on_connect: write` |
| the device is there, and has not answered a write | the value again, every RETRY_AFTER |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.devices.plan import Sending

RETRY_AFTER: Final = 1.0
"""Seconds after which a value is given again that the device has not answered, or that may be lost in it."""
_UNKNOWN: Final = (Quality.NEVER, Quality.STALE, Quality.UNAVAILABLE)
"""Qualities of a value that the robot does not report now."""


class Outflow:
    """Hands `send` what the device is to get: index of the variable, and value."""

    def __init__(self, cell: Cell, sendings: Sequence[Sending], send: Callable[[int, Value], None]) -> None:
        self._cell = cell
        self._sendings = tuple(sendings)
        self._send = send
        self._there = False
        self._known: dict[int, Value] = {}
        """What the device is taken to have of each output; without one, nothing was written since it came."""
        self._again: dict[int, float] = {}
        """When an output is to be written again."""
        self._renewed_at = -math.inf

    def rebind(self, cell: Cell, sendings: Sequence[Sending], variables: Mapping[int, int]) -> None:
        """Go on in the successor of the cell; `variables`: its indices there by those here."""
        self._cell, self._sendings = cell, tuple(sendings)
        self._known = {variables[index]: value for index, value in self._known.items() if index in variables}
        self._again = {variables[index]: time for index, time in self._again.items() if index in variables}

    def connect(self, now: float) -> None:
        """The device is there."""
        if not self._there:
            self._there = True
            self.update(now)

    def renew(self, now: float) -> None:
        """The connection is another one: what a device has that may have begun anew is not known any more.

        Not that of one that closes each connection, and not what waits for a change: that would not be written now.
        """
        if now - self._renewed_at < RETRY_AFTER:
            return
        self._renewed_at = now
        for sending in self._sendings:
            if sending.brings_up_to_date:
                self._known.pop(sending.variable, None)
                self._again.pop(sending.variable, None)
        self.update(now)

    def unanswered(self, variable: int, now: float) -> None:
        """A value was not taken, though the device has not refused it: it would never get it unless it changed."""
        if variable in self._known:
            self._again[variable] = min(self._again.get(variable, math.inf), now + RETRY_AFTER)

    def lose(self) -> None:
        """The device is gone: what it has is not known any more."""
        self._there = False
        self._known.clear()
        self._again.clear()

    def update(self, now: float) -> None:
        """Outputs of the cell may have changed."""
        if not self._there or not self._sendings:
            return
        image = self._cell.image
        for sending in self._sendings:
            index = sending.variable
            value = image.values[index]
            if index not in self._known:
                if self._is_reported(index):
                    self._known[index] = value
                    if sending.brings_up_to_date:
                        self._give(sending, value, now)
            elif index not in image.unreadable and not _is_same(value, self._known[index]):
                self._known[index] = value
                self._give(sending, value, now)

    def tick(self, now: float) -> None:
        """Write again what is due."""
        for sending in self._sendings:
            index = sending.variable
            if now >= self._again.get(index, math.inf):
                if index in self._cell.image.unreadable:
                    self._again[index] = now
                else:
                    del self._again[index]
                    self._give(sending, self._known[index], now)

    def _is_reported(self, index: int) -> bool:
        fresh = self._cell.freshness.state is Source.FRESH
        return fresh and self._cell.image.quality[index] not in _UNKNOWN

    def _give(self, sending: Sending, value: Value, now: float) -> None:
        if sending.every is not None:
            self._again[sending.variable] = now + sending.every
        self._send(sending.variable, value)


def _is_same(value: Value, other: Value) -> bool:
    """Whether there is nothing new; NaN is what NaN is."""
    return value == other or (value != value and other != other)  # noqa: PLR0124
