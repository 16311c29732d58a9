"""How long a controller has sent nothing of what is due, and how long is too long. Pure: time is a parameter."""

from __future__ import annotations

from gatewayd.rtde.session import ClientSettings
from gatewayd.rtde.strange import StrangePackage

_PERIODS_OF_PATIENCE = 5


class Silence:
    """That of one connection. Times in seconds."""

    __slots__ = ("_regular", "_timeout", "heard", "odd", "patience")

    def __init__(self, settings: ClientSettings) -> None:
        self.heard = 0.0
        """When a data package came last, or was due from."""
        self.patience = self._regular = settings.first_data_timeout
        """Time without a data package after which the connection is taken for dead."""
        self.odd: StrangePackage | None = None
        """The last strange package, if no data came since."""
        self._timeout = settings.data_timeout

    @property
    def regular(self) -> bool:
        """Whether there is nothing to note about a data package but its time."""
        return self.odd is None and self.patience == self._regular

    def expect(self, period: float) -> None:
        """Packages are to come with this period, once the first is there."""
        self._regular = max(self._timeout, _PERIODS_OF_PATIENCE * period)

    def data(self, now: float) -> None:
        """A data package has come."""
        self.heard = now
        self.odd = None
        self.patience = self._regular

    def exceeded(self, now: float) -> float | None:
        """For how long nothing has come, if that is too long."""
        silence = now - self.heard
        return silence if silence > self.patience else None

    def instead(self, unfinished: str) -> str:
        """What came in place of what was due, in words; `unfinished`: the beginning of a package, in words."""
        if unfinished:
            return f"; what it sent stops at {unfinished}"
        return f"; it sent {self.odd} instead" if self.odd is not None else ""
