"""How long to wait before the next attempt to reach a broker. Pure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

FIRST: Final = 0.5
"""Seconds before the second attempt."""
LAST: Final = 10.0
"""Seconds between two attempts at most: who repairs a broker does not wait for long."""


class ReconnectPause:
    """Doubles with every failure; a part of it is chance, so that a thousand gateways do not come back at once."""

    def __init__(self, chance: Callable[[], float]) -> None:
        self._chance = chance
        self._next = FIRST

    def failed(self) -> float:
        """Seconds to wait now: between half and the whole of the present step."""
        step, self._next = self._next, min(self._next * 2, LAST)
        return step * (0.5 + 0.5 * self._chance())

    def worked(self) -> None:
        """The next failure is the first one."""
        self._next = FIRST
