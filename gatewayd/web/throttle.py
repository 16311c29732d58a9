"""Wrong tokens are answered later and later, by the peer that gives them. Pure: time is a parameter.

Only the answer to a wrong one waits. A right one is never delayed, even if somebody else guesses behind the same
address (NAT): to lock a peer out would be a weapon against who belongs there, and against guessing it is not needed,
because nobody guesses 256 bits. What the delay is for: guesses stay few, cheap and visible.
"""

from __future__ import annotations

from collections import OrderedDict

from gatewayd.web.hosts import network_of

FIRST_DELAY = 0.25
"""Seconds that the first wrong token waits for its answer; each further one twice as long."""
MAX_DELAY = 8.0
FORGET_AFTER = 300.0
"""Seconds without a wrong token after which a peer is as any other."""
MAX_PEERS = 256
"""Peers that are remembered; the one that was quiet for longest goes."""


class WrongTokens:
    """Counts them for each peer: an IPv4 address, or an IPv6 network of 64 bits, which one machine has as a whole."""

    def __init__(self) -> None:
        self._peers: OrderedDict[str, tuple[int, float]] = OrderedDict()
        """How many, and when the last one came; the latest at the end."""

    def wrong(self, peer: str, now: float) -> tuple[int, float]:
        """Another one: how many that makes of this peer, and the seconds for which its answer waits."""
        key = network_of(peer)
        count, last = self._peers.pop(key, (0, now))
        count = 1 if now - last >= FORGET_AFTER else count + 1
        self._peers[key] = count, now
        while len(self._peers) > MAX_PEERS:
            self._peers.popitem(last=False)
        return count, min(MAX_DELAY, FIRST_DELAY * 2.0 ** min(count - 1, 16))

    def __len__(self) -> int:
        return len(self._peers)
