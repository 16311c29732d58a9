"""What goes to the log about a controller: that it cannot be reached, what it says, and what cannot be used of it."""

from __future__ import annotations

import logging
import math

from gatewayd.logs.records import fields
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.strange import StrangePackage

LOSS_INTERVAL = 60.0
"""Seconds after which a connection that still fails for the same reason is reported again."""

log = logging.getLogger("gatewayd.robot")


class ConnectionReports:
    """Why there is no session: the same reason is reported once in a while."""

    def __init__(self) -> None:
        self.trouble = ""
        """The last reason; empty since a session began."""
        self._at = -math.inf

    def connected(self) -> None:
        """A session has begun."""
        self.trouble, self._at = "", -math.inf

    def failed(self, cell: str, where: str, reason: str, now: float) -> None:
        """An attempt at a session has failed."""
        if reason != self.trouble or now - self._at >= LOSS_INTERVAL:
            self.trouble, self._at = reason, now
            log.warning("no robot", extra=fields(cell=cell, robot=where, reason=reason))


def report_text(cell: str, message: TextMessage) -> None:
    """The controller says something."""
    log.warning(
        "the controller says",
        extra=fields(cell=cell, text=message.message, source=message.source or None, severity=message.level),
    )


def report_strange(cell: str, package: StrangePackage) -> None:
    """A package could not be taken as it came."""
    log.warning("strange package", extra=fields(cell=cell, kind=package.oddity.value, reason=str(package)))


def report_kept(cell: str, variables: str) -> None:
    """The link ends, and fallbacks of these variables did not reach the robot."""
    log.warning("the robot keeps what it holds", extra=fields(cell=cell, variables=variables))
