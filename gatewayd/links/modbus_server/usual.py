"""Write requests that come again and again: what one means is worked out once, and kept.

A PLC asks for the same (address, quantity) in every cycle. `UsualWrites` keeps, for requests that were accepted, how
their data is decoded in one go and what it is to the cell. Whatever is not plain, at the limits, or not allowed is
left to the thorough way: `RegisterTable.changes` and `Cell.write`, which come to the same where this one acts.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple, TypeAlias

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.core.prepared import PreparedWrite
from gatewayd.core.requester import Requester

Decode: TypeAlias = Callable[[bytes], list[Value] | None]
"""Values of the variables, in their order; None: not in one go."""


class Meaning(NamedTuple):
    """What a request of so much data at an address writes."""

    variables: tuple[int, ...]
    decode: Decode
    bounds: tuple[tuple[float, float], ...] = ()
    """Of the first values: between which they are right; the others need more care."""


_Write: TypeAlias = Callable[[Requester, list[Value], float], bool]

CAPACITY = 256
"""Pairs of address and quantity that are kept in a table; the oldest makes room for one more."""


class UsualWrites:
    """The writes to one table of a unit."""

    def __init__(self, cell: Cell, meaning: Callable[[int, int], Meaning | None]) -> None:
        """`meaning(address, count)`: None where a request of that kind has to be looked at each time."""
        self._cell = cell
        self._meaning = meaning
        self._known: dict[tuple[int, int], tuple[Decode, _Write] | None] = {}

    def write(self, requester: Requester, address: int, count: int, data: bytes, now: float) -> bool:
        """Write `count` registers or bits. False: nothing was done, the request has to be looked at."""
        known = self._known.get((address, count))
        if known is None:
            return False
        decode, write = known
        values = decode(data)
        return values is not None and write(requester, values, now)

    def accepted(self, address: int, count: int) -> None:
        """Such a request was accepted after it was looked at: from now on it may be usual."""
        key = address, count
        if key in self._known:
            return
        if len(self._known) >= CAPACITY:
            del self._known[next(iter(self._known))]
        self._known[key] = None
        meaning = self._meaning(address, count)
        if meaning is not None:
            with suppress(ValueError):  # a bit of the robot's is among them, or a variable twice
                prepared = PreparedWrite(self._cell, meaning.variables, meaning.bounds)
                self._known[key] = meaning.decode, prepared.write
