"""What the codes of a broker's answers mean, in the words of the specifications."""

from __future__ import annotations

from typing import Final

FAILED: Final = 0x80
"""Codes from here on are refusals (5.0, 2.4; in 3.1.1 the only one of SUBACK)."""

_CONNECT_311: Final = {
    1: "unacceptable protocol version",
    2: "identifier rejected",
    3: "server unavailable",
    4: "bad user name or password",
    5: "not authorized",
}
"""3.1.1, 3.2.2.3."""

_REASONS: Final = {
    0x00: "success",
    0x80: "unspecified error",
    0x81: "malformed packet",
    0x82: "protocol error",
    0x83: "implementation specific error",
    0x84: "unsupported protocol version",
    0x85: "client identifier not valid",
    0x86: "bad user name or password",
    0x87: "not authorized",
    0x88: "server unavailable",
    0x89: "server busy",
    0x8A: "banned",
    0x8B: "server shutting down",
    0x8C: "bad authentication method",
    0x8D: "keep alive timeout",
    0x8E: "session taken over",
    0x8F: "topic filter invalid",
    0x90: "topic name invalid",
    0x91: "packet identifier in use",
    0x92: "packet identifier not found",
    0x93: "receive maximum exceeded",
    0x94: "topic alias invalid",
    0x95: "packet too large",
    0x96: "message rate too high",
    0x97: "quota exceeded",
    0x98: "administrative action",
    0x99: "payload format invalid",
    0x9A: "retain not supported",
    0x9B: "QoS not supported",
    0x9C: "use another server",
    0x9D: "server moved",
    0x9E: "shared subscriptions not supported",
    0x9F: "connection rate exceeded",
    0xA0: "maximum connect time",
    0xA1: "subscription identifiers not supported",
    0xA2: "wildcard subscriptions not supported",
}
"""5.0, 2.4."""


def connect_reason(code: int) -> str:
    """Why a broker refuses a connection: 3.1.1 and 5.0 have no code in common."""
    return _CONNECT_311.get(code) or reason(code)


def reason(code: int) -> str:
    """What a reason code of 5.0 says."""
    return _REASONS.get(code, f"code {code}")
