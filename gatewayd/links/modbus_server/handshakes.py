"""TLS handshakes that are under way: how many, for how long, and how much of the loop's time they get.

A handshake costs as much as a hundred requests, and anybody who reaches the port can begin one. So there are bounds:

- of number: a newcomer beyond them takes the place of the oldest handshake of the address that has most of them;
- of time: one that is not finished within `PATIENCE` ends;
- of work: one step at a time, and after each a pause of `PAUSE` times as long. Whatever comes, the robot's packages
  and everybody's requests have the rest of the loop's time.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Protocol

from gatewayd.links.modbus_server.peers import Address, PeerEventKind
from gatewayd.loop import clock

MAX_HANDSHAKES = 64
"""Of one listener."""
MAX_OF_PEER = 8
"""Of one address."""
PATIENCE = 5.0
"""Seconds from the connection to the end of the handshake."""
PAUSE = 4.0
"""The share of handshakes is a fifth of the time at most."""


class Handshaking(Protocol):
    """A connection whose handshake is under way."""

    @property
    def address(self) -> Address | None:
        """Of the peer."""

    def step(self) -> None:
        """Go on with what the peer has sent."""

    def fail(self, kind: PeerEventKind, reason: str) -> None:
        """End without having finished."""


class Handshakes:
    """Those of one listener."""

    def __init__(self) -> None:
        self._begun: dict[Handshaking, float] = {}
        """When each began; the oldest comes first."""
        self._waiting: dict[Handshaking, None] = {}
        """Those that can go on, in the order in which they will."""
        self._next: asyncio.Handle | None = None

    def __len__(self) -> int:
        return len(self._begun)

    def begin(self, newcomer: Handshaking, now: float) -> Handshaking | None:
        """One more handshake; returns the one that has to end for it, if there are too many."""
        count = Counter(each.address for each in self._begun)
        crowded = count[newcomer.address] >= MAX_OF_PEER
        greedy = newcomer.address if crowded else count.most_common(1)[0][0] if count else None
        self._begun[newcomer] = now
        if not crowded and len(self._begun) <= MAX_HANDSHAKES:
            return None
        return next(each for each in self._begun if each.address == greedy)

    def end(self, handshake: object) -> bool:
        """It is finished, or was ended; returns whether it was under way."""
        found = next((each for each in self._begun if each is handshake), None)
        if found is None:
            return False
        self._waiting.pop(found, None)
        del self._begun[found]
        return True

    def overdue(self, now: float) -> list[Handshaking]:
        """Those that took too long."""
        return [each for each, begun in self._begun.items() if now - begun > PATIENCE]

    def stood_still(self, length: float) -> None:
        """Nothing was read for this time: it is not the peers'."""
        self._begun = {each: begun + length for each, begun in self._begun.items()}

    def ready(self, handshake: Handshaking) -> None:
        """It can go on; its `step` is called when it is its turn."""
        self._waiting[handshake] = None
        if self._next is None:
            self._next = asyncio.get_running_loop().call_soon(self._turn)

    def close(self) -> None:
        """Call no `step` any more."""
        self._waiting.clear()
        self._begun.clear()
        if self._next is not None:
            self._next.cancel()

    def _turn(self) -> None:
        self._next = None
        begun = clock.now()
        if self._waiting:
            handshake = next(iter(self._waiting))
            del self._waiting[handshake]
            handshake.step()
        if self._waiting:
            pause = PAUSE * (clock.now() - begun)
            self._next = asyncio.get_running_loop().call_later(pause, self._turn)
