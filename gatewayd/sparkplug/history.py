"""Values that could not be sent, kept in memory until they can (specification 6.4.6, `is_historical`).

Bounded in number and in age. What has to go is the oldest, and is counted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.sparkplug.declarations import MetricValue


@dataclass(frozen=True, slots=True)
class HistoryLimits:
    """How much is kept, and how fast it is sent afterwards."""

    size: int = 10_000
    """Values at most, of all devices; 0 keeps none."""
    age: float = 3600.0
    """Seconds for which a value is kept."""
    rate: float = 500.0
    """Values a second that are sent at most, so that those of now are not kept waiting by the connection."""
    batch: int = 50
    """Values of one message at most."""


@dataclass(frozen=True, slots=True)
class StoredValue:
    """A value of a metric, and when it could not be sent."""

    name: str
    value: MetricValue
    since: float


class ValueHistory:
    """The values that wait, the oldest first. A device that is dead does not keep others waiting."""

    def __init__(self, limits: HistoryLimits) -> None:
        self.limits = limits
        self.dropped = 0
        """Values that were never sent."""
        self._waiting: dict[str, deque[StoredValue]] = {}
        self._size = 0
        self._next_send = 0.0

    def __len__(self) -> int:
        return self._size

    def add(self, device: str, stored: StoredValue) -> None:
        """Keep a value."""
        self._waiting.setdefault(device, deque()).append(stored)
        self._size += 1
        self.expire(stored.since)

    def next_batch(self, now: float, is_sendable: Callable[[str], bool]) -> tuple[str, list[StoredValue]]:
        """A device and what may be sent of it now, in its order. It is kept until it is `sent`."""
        self.expire(now)
        devices = [device for device in self._waiting if is_sendable(device)]
        if not devices or now < self._next_send:
            return "", []
        device = min(devices, key=self._oldest)
        waiting = self._waiting[device]
        return device, [waiting[index] for index in range(min(self.limits.batch, len(waiting)))]

    def sent(self, device: str, batch: list[StoredValue], now: float) -> None:
        """The batch is on its way."""
        for _ in batch:
            self._pop(device)
        self._next_send = now + len(batch) / self.limits.rate

    def keep(self, is_known: Callable[[str, str], bool]) -> None:
        """Drop those of devices and metrics that are no more."""
        former, self._waiting = self._waiting, {}
        for device, waiting in former.items():
            kept = deque(stored for stored in waiting if is_known(device, stored.name))
            self.dropped += len(waiting) - len(kept)
            self._size -= len(waiting) - len(kept)
            if kept:
                self._waiting[device] = kept

    def expire(self, now: float) -> None:
        """Drop what is too much, or too old."""
        while self._waiting:
            device = min(self._waiting, key=self._oldest)
            if self._size <= self.limits.size and self._oldest(device) >= now - self.limits.age:
                return
            self._pop(device)
            self.dropped += 1

    def _oldest(self, device: str) -> float:
        return self._waiting[device][0].since

    def _pop(self, device: str) -> None:
        waiting = self._waiting[device]
        waiting.popleft()
        self._size -= 1
        if not waiting:
            del self._waiting[device]
