"""Why there is no session with the controller, in plain words."""

from __future__ import annotations

import errno
import socket
from dataclasses import dataclass
from enum import Enum


class LossReason(Enum):
    """Kinds of loss, stable names for logs."""

    REFUSED = "refused"
    """Nobody listens on the port."""
    UNREACHABLE = "unreachable"
    """No route, or no answer to the connection request."""
    UNRESOLVED = "unresolved"
    """The host name is not known."""
    CLOSED = "closed"
    """The controller ended the connection."""
    UNANSWERED = "unanswered"
    """A request of the set-up was not answered in time."""
    HANDSHAKE = "handshake"
    """The set-up cannot be completed."""
    PROTOCOL = "protocol"
    """Bytes that are not RTDE."""
    SILENT = "silent"
    """No data although the output runs."""
    RESTARTED = "restarted"
    """The controller's clock went back: it has restarted its RTDE service."""
    CONGESTED = "congested"
    """The controller does not take in what is sent."""
    RECIPES = "recipes"
    """All recipe ids of the connection are used up; a new connection starts again at 1."""
    RECONNECT = "reconnect"
    """The user of the client asked for a new connection."""
    FAILED = "failed"
    """Another failure of the connection."""


@dataclass(frozen=True, slots=True)
class Loss:
    """The end of a session, or of an attempt at one."""

    reason: LossReason
    text: str
    """One line for people, with cause and remedy as far as known."""
    started: bool = False
    """A session had been up; else the attempt did not get that far."""
    attempts: int = 0
    """Attempts in a row that have failed, this one included; 0 after a session."""
    retry_in: float = 0.0
    """Seconds until the next attempt."""


_BY_ERRNO = {
    errno.ECONNREFUSED: (
        LossReason.REFUSED,
        "connection refused: the robot is booting, or its RTDE service is off (Settings > Security > Services)",
    ),
    errno.EHOSTUNREACH: (LossReason.UNREACHABLE, "no route to the robot: check cable, address and switch"),
    errno.ENETUNREACH: (
        LossReason.UNREACHABLE,
        "network unreachable: check this machine's address and gateway",
    ),
    errno.ENETDOWN: (LossReason.UNREACHABLE, "the network interface of this machine is down"),
    errno.ETIMEDOUT: (
        LossReason.UNREACHABLE,
        "the robot does not answer: is it powered, and is the address right?",
    ),
    errno.ECONNRESET: (LossReason.CLOSED, "connection reset by the controller"),
    errno.EPIPE: (LossReason.CLOSED, "connection closed by the controller"),
}


def connect_failure(error: OSError, address: str) -> Loss:
    """What a failed connection attempt to `address` (for reading) means."""
    if isinstance(error, socket.gaierror):
        return Loss(LossReason.UNRESOLVED, f"{address}: host name not known: {error.strerror}")
    return _by_errno(error, errno.ETIMEDOUT if isinstance(error, TimeoutError) else error.errno, address)


def connection_failure(error: OSError | None, address: str) -> Loss:
    """What the end of an established connection means; None: the controller closed it in order."""
    if error is None:
        return Loss(LossReason.CLOSED, f"{address}: connection closed by the controller")
    if isinstance(error, TimeoutError):
        return Loss(LossReason.SILENT, f"{address}: the controller no longer answers: cable or power lost")
    return _by_errno(error, error.errno, address)


def _by_errno(error: OSError, number: int | None, address: str) -> Loss:
    unknown = LossReason.FAILED, f"connection failed: {error.strerror or error}"
    reason, text = _BY_ERRNO.get(number or 0, unknown)
    return Loss(reason, f"{address}: {text}")
