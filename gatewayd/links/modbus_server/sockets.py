"""What is set on the sockets of connections, and what the kernel knows of them."""

from __future__ import annotations

import fcntl
import socket
import struct
import termios

# A pulled cable is noticed after KEEPIDLE + KEEPCNT * KEEPINTVL seconds, or TCP_USER_TIMEOUT with answers under way.
_KEEPALIVE = (
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 2),
    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 5000),
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
)
_COUNT = struct.Struct("=i")
_LAST_DATA_SENT = struct.Struct("=44xI")
"""The field of `struct tcp_info` (linux/tcp.h), milliseconds."""


def set_options(sock: socket.socket) -> None:
    """Set what the platform knows; a connection that is gone already is none of our business."""
    try:
        for level, option, value in _KEEPALIVE:
            sock.setsockopt(level, option, value)
    except OSError:
        return


def has_unread(descriptor: int) -> bool:
    """Whether the socket has bytes that were not read."""
    try:
        found: int = _COUNT.unpack(fcntl.ioctl(descriptor, termios.FIONREAD, bytes(_COUNT.size)))[0]
    except OSError:  # it has ended
        return False
    return found > 0


def seconds_since_established(sock: socket.socket) -> float:
    """Age of a TCP connection on which nothing was sent so far; time of suspension is not in it."""
    try:
        information = sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _LAST_DATA_SENT.size)
        milliseconds: int = _LAST_DATA_SENT.unpack(information)[0]
    except (OSError, struct.error):  # it has ended
        return 0.0
    return milliseconds / 1000
