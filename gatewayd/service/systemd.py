"""What is sent to the service manager: one datagram per message to the socket it named (sd_notify(3)).

Without a service manager everything here does nothing. Nothing waits and nothing raises: a manager that does not read
must not hold up the robot.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from contextlib import suppress

from gatewayd.report.printable import printable

LONGEST_STATUS = 1000
"""Characters of a status; what is longer is cut."""


class Notifier:
    """Speaks to the manager that `environment` names in NOTIFY_SOCKET.

    `process` is our own process id: WATCHDOG_USEC counts only where WATCHDOG_PID is absent or ours. Each method
    returns whether the message was sent.
    """

    def __init__(self, environment: Mapping[str, str], process: int) -> None:
        self._address = _address(environment.get("NOTIFY_SOCKET", ""))
        self._socket: socket.socket | None = None
        self.watchdog_after = _watchdog(environment, process) if self._address else None
        """Seconds without `watchdog` after which the manager ends us; None: it does not watch."""

    def ready(self, status: str = "") -> bool:
        """Start-up or reload is complete."""
        return self._send("READY=1" + _status(status))

    def status(self, text: str) -> bool:
        """One sentence about how it goes, shown by `systemctl status`."""
        return self._send(_status(text).lstrip("\n"))

    def reloading(self, now: float, status: str = "") -> bool:
        """A reload begins; `ready` has to follow whether it succeeds or not. `now` is of CLOCK_MONOTONIC, seconds."""
        return self._send(f"RELOADING=1\nMONOTONIC_USEC={int(now * 1_000_000)}" + _status(status))

    def stopping(self, status: str = "") -> bool:
        """The end has begun."""
        return self._send("STOPPING=1" + _status(status))

    def watchdog(self) -> bool:
        """All is alive."""
        return self._send("WATCHDOG=1")

    def close(self) -> None:
        """Give the socket back; a later message opens it again."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, message: str) -> bool:
        if not self._address or not message:
            return False
        try:
            if self._socket is None:
                self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
                self._socket.setblocking(False)
            self._socket.sendto(message.encode(errors="replace"), self._address)
        except OSError:
            return False
        return True


def _address(name: str) -> bytes:
    """The socket's address: a path, or a name in the abstract namespace, which `@` stands for."""
    if not name.startswith(("/", "@")) or len(name) < 2:
        return b""
    with suppress(UnicodeEncodeError):
        encoded = name.encode("utf-8", "surrogateescape")
        return b"\0" + encoded[1:] if name.startswith("@") else encoded
    return b""


def _status(text: str) -> str:
    """The assignment, after a line break; a status of several lines would be several assignments."""
    return f"\nSTATUS={printable(' '.join(text.split()), LONGEST_STATUS)}" if text else ""


def _watchdog(environment: Mapping[str, str], process: int) -> float | None:
    meant_for = environment.get("WATCHDOG_PID", "")
    if meant_for and meant_for != str(process):
        return None
    try:
        microseconds = int(environment.get("WATCHDOG_USEC", ""))
    except ValueError:
        return None
    return microseconds / 1_000_000 if microseconds > 0 else None
