"""The state of a primary host application, as its STATE messages tell it (specification 5.4, 5.10).

The payload is a JSON object with `online` and `timestamp` since specification 3.0; the plain texts ONLINE and OFFLINE
of 2.2 lack the timestamp by which an old death certificate is told from a new one, so they are refused.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from gatewayd.sparkplug.wire import MAX_UINT64, PayloadError

MAX_STATE = 1024
"""Bytes of a STATE message that are looked at."""


@dataclass(frozen=True, slots=True)
class HostState:
    """A STATE message."""

    is_online: bool
    timestamp: int
    """Milliseconds of UTC, of the host's MQTT session."""


def decode_host_state(data: bytes) -> HostState:
    """A STATE message, or a PayloadError."""
    if len(data) > MAX_STATE:
        raise PayloadError(f"has {len(data)} bytes; a STATE message has at most {MAX_STATE}")
    try:
        content: Any = json.loads(data)
    except (ValueError, RecursionError):
        raise PayloadError(f"{data[:40]!r} is not the JSON of a STATE message (specification 3.0)") from None
    online, timestamp = (
        (content.get(key) for key in ("online", "timestamp")) if isinstance(content, dict) else (None, None)
    )
    if not isinstance(online, bool):
        raise PayloadError("has no `online` that is true or false")
    if isinstance(timestamp, float) and timestamp.is_integer():
        timestamp = int(timestamp)
    if not isinstance(timestamp, int) or isinstance(timestamp, bool) or not 0 <= timestamp <= MAX_UINT64:
        raise PayloadError("has no `timestamp` in milliseconds")
    return HostState(online, timestamp)


class PrimaryHost:
    """What is known of the host in one MQTT session.

    A STATE message counts if its timestamp is not before that of the one before it: the death certificate of a session
    that the host has left may arrive late (tck-id-message-flow-edge-node-birth-publish-phid-wait-timestamp,
    tck-id-operational-behavior-edge-node-termination-host-offline-timestamp). Timestamps are compared within a session
    of ours only: every server has its own (tck-id-operational-behavior-host-application-multi-server-timestamp), and a
    host whose clock was set back would otherwise be offline for ever.
    """

    def __init__(self) -> None:
        self.is_online = False
        self._last: int | None = None

    def session_begins(self) -> None:
        """A new MQTT session: nothing is known."""
        self.is_online = False
        self._last = None

    def receive(self, data: bytes) -> bool:
        """A STATE message of this host: whether it is online. PayloadError if the message does not count."""
        state = decode_host_state(data)
        if self._last is not None and state.timestamp < self._last:
            raise PayloadError(
                f"its timestamp {state.timestamp} is before {self._last}, that of the last one"
            )
        self._last = state.timestamp
        self.is_online = state.is_online
        return state.is_online
