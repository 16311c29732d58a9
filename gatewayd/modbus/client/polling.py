"""When the groups of a poll class are read. Pure; seconds of any one clock."""

from __future__ import annotations

from gatewayd.modbus.client.grouping import PollClass, ReadGroup
from gatewayd.modbus.client.requests import ModbusRequest

NEVER = float("inf")
AT_ONCE = float("-inf")


class PollCycle:
    """One poll class at work: all its requests in turn, once in a period.

    Nothing that is answered, or not answered, ends it. A cycle that takes longer than the period begins again at once;
    none is made up for.
    """

    __slots__ = ("_due", "_failed", "_parts", "_position", "_steps", "_underway", "poll")

    def __init__(self, poll: PollClass) -> None:
        self.poll = poll
        self._steps = [(group, part) for group in poll.groups for part in range(len(group.requests))]
        self._position = len(self._steps)
        self._underway = 0
        self._due = AT_ONCE
        self._parts: dict[int, list[bytes | None]] = {}
        self._failed: set[int] = set()

    @property
    def due(self) -> float:
        """From when it wants to send a request; NEVER while it waits for its last answers."""
        if self._position < len(self._steps):
            return AT_ONCE
        return NEVER if self._underway or not self._steps else self._due

    @property
    def next_due(self) -> float:
        """When it is read next as far as its period is concerned."""
        return self._due

    def restart(self, now: float) -> None:
        """Begin from the first request; what is underway still counts as underway."""
        self._due = now
        self._position = len(self._steps)

    def take(self, now: float) -> tuple[ReadGroup, int, ModbusRequest]:
        """The next request, its group, and its place in it. Only when `due` has come."""
        if self._position == len(self._steps):
            self._position = 0
            self._failed.clear()
            self._parts.clear()
            planned = now if self._due == AT_ONCE else self._due
            self._due = max(planned + self.poll.period, now)
        group, part = self._steps[self._position]
        self._underway += 1
        self._position += 1
        return group, part, group.requests[part]

    def repeat(self, group: ReadGroup, part: int) -> ModbusRequest:
        """A request that has failed is sent once more, whatever the period; its answer counts as any."""
        self._underway += 1
        return group.requests[part]

    def answered(self, group: ReadGroup, part: int, data: bytes) -> bytes | None:
        """One of its requests has brought `data`; the data of the whole group, once they are there."""
        self._underway -= 1
        if len(group.requests) == 1:
            return data
        parts = self._parts.setdefault(id(group), [None] * len(group.requests))
        parts[part] = data
        if None in parts or id(group) in self._failed:
            return None
        return _joined(group, [piece for piece in parts if piece is not None])

    def failed(self, group: ReadGroup) -> bool:
        """One of its requests has failed: the group's rest is not read. Whether it is the group's first failure."""
        self._underway -= 1
        while self._position < len(self._steps) and self._steps[self._position][0] is group:
            self._position += 1
        is_first = id(group) not in self._failed
        self._failed.add(id(group))
        return is_first


def _joined(group: ReadGroup, parts: list[bytes]) -> bytes:
    """Parts of registers one behind the other. Parts of bits may end within a byte."""
    if not group.area.of_bits:
        return b"".join(parts)
    number = position = 0
    for request, part in zip(group.requests, parts, strict=True):
        count = int.from_bytes(request.pdu[3:5], "big")
        number |= (int.from_bytes(part, "little") & ((1 << count) - 1)) << position
        position += count
    return number.to_bytes((group.size + 7) // 8, "little")
