"""What two gateways tell each other, ten times a second in one datagram: who they are and how they are. Pure.

A datagram is believed only if it repeats the number that its reader drew when it started: its sender receives
what is sent to the other gateway. What does not fit in every byte is dropped and counted. Nothing in it makes a
gateway write, and none of it decides who serves the cell: that does the robot, by its claims.

    offset  bytes
         0      4  `GWSB`
         4      1  version, 1
         5      1  role (`StandbyRole`)
         6      1  bit 0: it has a session with the robot; bit 1: it is ready to take over
         7      1  0
         8      4  fingerprint of the mapping
        12      8  number of the sender
        20      8  number of the reader, as the sender heard it last; 0: it has not heard it
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from gatewayd.links.standby.roles import StandbyRole

_LAYOUT = struct.Struct(">4sBBBBIQQ")
SIZE = _LAYOUT.size
_MAGIC = b"GWSB"
VERSION = 1
_CONNECTED, _READY = 1, 2
_ROLES = {role.value: role for role in StandbyRole}


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """One datagram."""

    role: StandbyRole
    connected: bool
    """The sender has a session with the robot."""
    ready: bool
    """It would take over at once."""
    fingerprint: int
    number: int
    """Drawn by the sender when it started."""
    echo: int
    """The last number of the reader that the sender has heard."""


def encode(heartbeat: Heartbeat) -> bytes:
    """The datagram."""
    flags = (_CONNECTED if heartbeat.connected else 0) | (_READY if heartbeat.ready else 0)
    return _LAYOUT.pack(
        _MAGIC,
        VERSION,
        heartbeat.role.value,
        flags,
        0,
        heartbeat.fingerprint,
        heartbeat.number,
        heartbeat.echo,
    )


def decode(data: bytes) -> Heartbeat | None:
    """What a datagram says; None where it is none of ours."""
    if len(data) != SIZE:
        return None
    magic, version, role, flags, zero, fingerprint, number, echo = _LAYOUT.unpack(data)
    if magic != _MAGIC or version != VERSION or zero or flags & ~(_CONNECTED | _READY) or not number:
        return None
    known = _ROLES.get(role)
    if known is None:
        return None
    return Heartbeat(known, bool(flags & _CONNECTED), bool(flags & _READY), fingerprint, number, echo)
