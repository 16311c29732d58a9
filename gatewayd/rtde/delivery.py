"""Data packages on their way to the user of a client: unpacked, counted, handed on in their order."""

from __future__ import annotations

import struct
from collections.abc import Callable

from gatewayd.rtde.handler import ClientHandler
from gatewayd.rtde.pace import Pace, Statistics
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.session import TIMESTAMP, Session
from gatewayd.rtde.types import DataType

_MOST_EARLIER = 64
"""Packages that are handed on before the newest of those that came together: a burst takes a bounded time."""
BEGINNING = struct.Struct(">I")
"""What is before the values of a data package, its size, type and recipe id, as one number: quick to compare."""


class SteadyOutput:
    """How a read is told, without decoding it, that is one package of the working recipe and nothing else."""

    __slots__ = ("beginning", "size", "taken")

    def __init__(self) -> None:
        self.size = 0
        """Its bytes; 0: whatever comes is to be decoded."""
        self.beginning = 0
        """The first of them."""
        self.taken = 0
        """Bytes that were not decoded."""

    def expect(self, header: bytes, size: int) -> None:
        """What is due begins like this, `size` bytes of values follow."""
        (self.beginning,) = BEGINNING.unpack(header)
        self.size = len(header) + size

    def stop(self) -> int:
        """Decode what comes; how many bytes were not since the last stop."""
        taken, self.taken, self.size = self.taken, 0, 0
        return taken


class OutputDelivery:
    """The packages of one working recipe. `every`: hand on all of them, however many came together."""

    __slots__ = ("_clocked", "_every", "_handler", "_statistics", "outputs", "pace")

    def __init__(
        self, session: Session, handler: ClientHandler, statistics: Statistics, now: float, *, every: bool
    ) -> None:
        self.outputs: Recipe = session.outputs
        """The working recipe."""
        self.pace = Pace(session.period, statistics, now)
        """Their rhythm."""
        self._clocked = session.outputs.names[0] == TIMESTAMP and session.outputs.types[0] is DataType.DOUBLE
        self._handler = handler
        self._statistics = statistics
        self._every = every

    def deliver(self, payloads: list[bytes], now: float, ended: Callable[[], bool]) -> str | None:
        """Hand on packages of the recipe that came together, at least one: their values, without the recipe id.

        None, or in words why the connection cannot go on. Stops when `ended` says that it has.
        """
        newest = payloads.pop()
        for left, payload in zip(range(len(payloads), 0, -1), payloads, strict=True):
            values = self.outputs.unpack(payload)
            last = self.pace.timestamp
            if self._clocked and not self.pace.package(values[0], now):
                return _restarted(last, values)
            wanted = self._every or (self._clocked and left <= _MOST_EARLIER)
            self._statistics.overtaken += not (wanted and self._handler.earlier(values, now))
            if ended():
                return None
        return self.deliver_newest(self.outputs.unpack(newest), now)

    def deliver_newest(self, values: tuple[Scalar, ...], now: float) -> str | None:
        """Hand on the values of a package after which none has come yet; as `deliver`."""
        last = self.pace.timestamp
        if self._clocked and not self.pace.package(values[0], now):
            return _restarted(last, values)
        self._handler.values(values, now)
        return None


def _restarted(last: float | None, values: tuple[Scalar, ...]) -> str:
    return f"the controller's clock went from {last} s to {values[0]} s: its RTDE service has restarted"
