"""Whether a client's machine acknowledges what it is sent, by what the kernel knows of the connection (TCP_INFO)."""

from __future__ import annotations

import socket
import struct

LOOK_PERIOD = 0.02
"""Seconds between two looks."""

# struct tcp_info of linux/tcp.h: tcpi_unacked at 24, tcpi_last_ack_recv (milliseconds) at 56.
_INFO = struct.Struct("=24xI28xI")


class Acknowledging:
    """What is known of one connection."""

    def __init__(self) -> None:
        self._looked_at = -LOOK_PERIOD
        self._due_since: float | None = None
        """Since when something is sent and nothing has been acknowledged."""

    def silent(self, sock: socket.socket, now: float, limit: float) -> bool:
        """Whether for `limit` seconds something was under way, and no acknowledgement came."""
        if now - self._looked_at < LOOK_PERIOD:
            return False
        self._looked_at = now
        unacknowledged, last_heard = _look(sock)
        if not unacknowledged:
            self._due_since = None
            return False
        heard_at = now - last_heard
        self._due_since = now if self._due_since is None else max(self._due_since, heard_at)
        return now - self._due_since >= limit


def _look(sock: socket.socket) -> tuple[int, float]:
    """Packets that are under way, and seconds since the last acknowledgement."""
    unacknowledged, milliseconds = _INFO.unpack(
        sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _INFO.size)
    )
    return unacknowledged, milliseconds / 1000
