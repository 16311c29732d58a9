"""The words of the status block that a TPDO can carry, as the object dictionary has them (5F00h and 5F40h on).

Said a second time here, so that a check need not import the running core; a test compares it with `core.status.FIELDS`.
Only numbers that can be read: the words that take requests for locks say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from gatewayd.canopen.datatypes import CanType

__all__ = ["FIELD_NAMES", "StatusWord", "field_word", "quality_word"]

_HEADER: Final = 0x5F00
_QUALITY: Final = 0x5F40
_LARGEST_ARRAY: Final = 254
_FIELDS: Final = (
    ("layout", 1),
    ("flags", 1),
    ("fingerprint", 2),
    ("heartbeat", 1),
    ("variables", 1),
    ("writers", 1),
    ("robot_state", 1),
    ("uptime", 2),
    ("robot_age", 2),
    ("frequency", 1),
    ("sessions", 1),
    ("packages", 2),
    ("skipped", 2),
    ("late", 2),
    ("accepted", 2),
    ("refused", 2),
    ("mismatches", 2),
    ("modbus_connections", 1),
    ("can_bus", 1),
    ("nmt_state", 1),
    ("refusal_reason", 1),
    ("refusal_variable", 1),
    ("refusal_writer", 1),
    ("refusal_holder", 1),
    ("refusal_age", 2),
    ("request", 1),
    ("release", 1),
    ("unadopted", 1),
    ("differing", 1),
    ("lag", 2),
    ("adoption", 1),
    ("program", 1),
    ("gaps", 1),
)
"""Name and words of every field, in the order of the sub-indices."""
_TYPES: Final = {1: CanType.UNSIGNED16, 2: CanType.UNSIGNED32}
_SUBINDICES: Final = {name: (number, _TYPES[words]) for number, (name, words) in enumerate(_FIELDS, 1)}

FIELD_NAMES: Final = tuple(name for name, _ in _FIELDS if name not in ("request", "release"))
"""Fields of the header that a TPDO can carry."""


@dataclass(frozen=True, slots=True)
class StatusWord:
    """One word of the status block in a TPDO."""

    name: str
    """As the mapping names it: `flags`, `quality of recipe[3]`."""
    index: int
    subindex: int
    type: CanType
    quality_of: int | None = None
    """Index of the variable whose quality it is."""


def field_word(name: str) -> StatusWord:
    """A field of the header, one of `FIELD_NAMES`."""
    subindex, can_type = _SUBINDICES[name]
    return StatusWord(name, _HEADER, subindex, can_type)


def quality_word(variable: int, name: str) -> StatusWord:
    """The quality of the variable with that index and name."""
    further, member = divmod(variable, _LARGEST_ARRAY)
    return StatusWord(f"quality of {name}", _QUALITY + further, member + 1, CanType.UNSIGNED16, variable)
