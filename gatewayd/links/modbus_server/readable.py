"""Whether a range of addresses may be read: one look at the number of readable addresses that follow its first one."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator
from typing import Any

ADDRESSES = 65536
"""Of each Modbus table."""
_BYTE = 0xFF


class Readable:
    """For every address, how many may be read from it on in one request.

    `reach` is what counts now; `mapped` is what would count if no variable were held back.
    """

    __slots__ = ("_held_back", "_longest", "mapped", "reach")

    def __init__(self, addresses: Iterable[int], longest: int) -> None:
        self._longest = longest
        self._held_back: list[range] = []
        self.mapped: bytearray | array[int] = _zeros(ADDRESSES, longest)
        falling = _numbers(range(longest, 0, -1), longest)
        for run in _runs(addresses):
            full = max(0, len(run) - longest)
            self.mapped[run.start : run.start + full] = falling[:1] * full
            self.mapped[run.start + full : run.stop] = falling[longest - len(run) + full :]
        self.reach: bytearray | array[int] = self.mapped[:]

    def hold_back(self, addresses: frozenset[int]) -> None:
        """Make every read that touches one of `addresses` fail, until the next call.

        Costs what the addresses need, however many others there are: it happens while the robot is lost.
        """
        held_back = list(_runs(addresses))
        if held_back == self._held_back:
            return
        # In place: connections keep a reference to it.
        reach: Any = self.reach
        for run in self._held_back:
            begin = max(0, run.start - self._longest + 1)
            reach[begin : run.stop] = self.mapped[begin : run.stop]
        for run in held_back:
            reach[run.start : run.stop] = _zeros(len(run), self._longest)
            for ahead in range(1, min(self._longest, run.start + 1)):
                if reach[run.start - ahead] <= ahead:
                    break
                reach[run.start - ahead] = ahead
        self._held_back = held_back


def _numbers(numbers: Iterable[int], longest: int) -> Any:
    """A bytearray where that is enough: it is looked at with every read."""
    return bytearray(numbers) if longest <= _BYTE else array("H", numbers)


def _zeros(count: int, longest: int) -> Any:
    """The same, all zero, without an object for each: a unit has four tables, and every start makes them."""
    return bytearray(count) if longest <= _BYTE else array("H", bytes(2 * count))


def _runs(addresses: Iterable[int]) -> Iterator[range]:
    """The addresses as ranges without a gap, ascending."""
    start = end = -1
    for address in sorted(set(addresses)):
        if address != end:
            if end > start:
                yield range(start, end)
            start = address
        end = address + 1
    if end > start:
        yield range(start, end)
