"""COB-IDs: the predefined connection set and what nobody may use (CiA 301, 7.3.3 and 7.3.5)."""

from __future__ import annotations

from enum import IntEnum

BASIC_FRAME = 0x7FF
"""Mask of an 11-bit identifier."""
INVALID = 0x8000_0000
"""Bit 31 of a COB-ID entry: the service does not exist (PDO, EMCY)."""


class Function(IntEnum):
    """Base COB-IDs; a node's own ones are base + node-ID where a node has one."""

    NMT = 0x000
    SYNC = 0x080
    EMCY = 0x080
    TIME = 0x100
    TPDO1 = 0x180
    RPDO1 = 0x200
    SDO_RESPONSE = 0x580
    SDO_REQUEST = 0x600
    ERROR_CONTROL = 0x700
    LSS_RESPONSE = 0x7E4
    LSS_REQUEST = 0x7E5


_RESTRICTED = (
    (0x000, 0x000),
    (0x001, 0x07F),
    (0x101, 0x180),
    (0x581, 0x5FF),
    (0x601, 0x67F),
    (0x6E0, 0x6FF),
    (0x701, 0x77F),
    (0x780, 0x7FF),
)

_NODE_ID = 0x7F
_OF_NODES = frozenset(
    (Function.EMCY, *range(Function.TPDO1, Function.SDO_REQUEST + 1, 0x80), Function.ERROR_CONTROL)
)


def is_restricted(can_id: int) -> bool:
    """Whether no configurable service (PDO, SYNC, TIME, EMCY) may have this identifier."""
    return any(low <= can_id <= high for low, high in _RESTRICTED)


def is_assignable(entry: int, flags: int) -> bool:
    """Whether a COB-ID entry holds nothing but some of `flags` and an 11-bit identifier that a service may have."""
    return not entry & ~(flags | BASIC_FRAME) and not is_restricted(entry & BASIC_FRAME)


def predefined_pdo(number: int, node: int, *, transmit: bool) -> int | None:
    """The predefined COB-ID of a node's PDO `number` (from 1); None beyond the fourth."""
    if not 1 <= number <= 4:
        return None
    return (Function.TPDO1 if transmit else Function.RPDO1) + 0x100 * (number - 1) + node


def node_of(can_id: int) -> int | None:
    """The node whose identifier it is in the predefined connection set; None: nobody's alone (NMT, SYNC, LSS, ...)."""
    base, node = can_id & ~_NODE_ID, can_id & _NODE_ID
    return node if node and base in _OF_NODES else None
