"""A CAN data or remote frame with an 11-bit identifier: all that CANopen uses of CAN."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple


class Frame(NamedTuple):
    """One frame. Its length code is the length of `data`, or `length` for a remote frame."""

    can_id: int
    """COB-ID, 0 to 0x7FF."""
    data: bytes = b""
    remote: bool = False
    length: int = 0
    """Length code of a remote frame, which carries no data."""


class Priority(IntEnum):
    """What becomes of a frame that cannot be sent at once."""

    AT_ONCE = 0
    """It goes out at once or not at all: SYNC, which is worth nothing later."""
    NEWEST = 1
    """The newest of each COB-ID replaces the one that waits: PDO, heartbeat, guarding."""
    EVENT = 2
    """First in, first out, with room of their own: boot-up and EMCY."""
    ORDERED = 3
    """First in, first out: SDO, LSS."""


Send = Callable[[Frame, Priority], bool]
"""Hands a frame to the bus; never waits, never fails. False: it was dropped, and will not go out."""
