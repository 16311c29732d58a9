"""Changes kept while a broker is away, bounded in number and in time; what is lost by that is counted. Pure."""

from __future__ import annotations

from collections import deque

from gatewayd.links.mqtt.publisher import ValueSample


class ChangeStore:
    """The oldest come out first, and are the first to go."""

    def __init__(self, keep: float | None, size: int) -> None:
        self.dropped = 0
        self._keep = keep
        self._size = size
        self._kept: deque[tuple[float, ValueSample]] = deque()

    def __len__(self) -> int:
        return len(self._kept)

    def add(self, sample: ValueSample, now: float) -> None:
        """Keep a change; where nothing is kept it counts as dropped."""
        if self._keep is None:
            self.dropped += 1
            return
        self.expire(now)
        if len(self._kept) >= self._size:
            self._kept.popleft()
            self.dropped += 1
        self._kept.append((now, sample))

    def expire(self, now: float) -> None:
        """Drop what is too old."""
        while self._kept and self._keep is not None and now - self._kept[0][0] > self._keep:
            self._kept.popleft()
            self.dropped += 1

    def first(self) -> ValueSample | None:
        """The oldest; it stays until `sent`."""
        return self._kept[0][1] if self._kept else None

    def sent(self) -> None:
        """The oldest was taken."""
        self._kept.popleft()

    def succeed(self, former: ChangeStore) -> None:
        """Go on with what the former one keeps, within the bounds of this one."""
        self.dropped = former.dropped
        for time, sample in former._kept:
            self.add(sample, time)
