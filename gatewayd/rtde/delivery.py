"""Data packages on their way to the user of a client: unpacked, counted, handed on in their order."""

from __future__ import annotations

from collections.abc import Callable

from gatewayd.rtde.handler import ClientHandler
from gatewayd.rtde.messages import DataPackage
from gatewayd.rtde.pace import Pace, Statistics
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.session import TIMESTAMP, Session
from gatewayd.rtde.types import DataType

_MOST_EARLIER = 64
"""Packages that are handed on before the newest of those that came together: a burst takes a bounded time."""


class OutputDelivery:
    """The packages of one working recipe. `every`: hand on all of them, however many came together."""

    def __init__(
        self, session: Session, handler: ClientHandler, statistics: Statistics, now: float, *, every: bool
    ) -> None:
        self.outputs: Recipe = session.outputs
        """The working recipe."""
        self.period = session.period
        """Seconds between packages."""
        self.pace = Pace(session.period, statistics, now)
        """Their rhythm."""
        self._clocked = session.outputs.names[0] == TIMESTAMP and session.outputs.types[0] is DataType.DOUBLE
        self._handler = handler
        self._statistics = statistics
        self._every = every

    def deliver(self, packages: list[DataPackage], now: float, ended: Callable[[], bool]) -> str | None:
        """Hand on packages of the recipe that came together, at least one.

        None, or in words why the connection cannot go on. Stops when `ended` says that it has.
        """
        newest = packages.pop()
        for left, package in zip(range(len(packages), 0, -1), packages, strict=True):
            values = self._counted(package, now)
            if isinstance(values, str):
                return values
            wanted = self._every or (self._clocked and left <= _MOST_EARLIER)
            self._statistics.overtaken += not (wanted and self._handler.earlier(values, now))
            if ended():
                return None
        values = self._counted(newest, now)
        if isinstance(values, str):
            return values
        self._handler.values(values, now)
        return None

    def _counted(self, package: DataPackage, now: float) -> tuple[Scalar, ...] | str:
        """The values of a package; in words what shows that the controller has restarted."""
        values, last = self.outputs.unpack(package.payload), self.pace.timestamp
        if not self._clocked or self.pace.package(values[0], now):
            return values
        return f"the controller's clock went from {last} s to {values[0]} s: its RTDE service has restarted"
