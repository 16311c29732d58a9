"""The words of the status block that a TPDO can carry, as the object dictionary has them (5F00h and 5F40h on).

Only numbers that can be read: the words that take requests for locks say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.status_layout import RELEASE, REQUEST
from gatewayd.links.registry import status_fields

HEADER: Final = 0x5F00
"""The record of the header's fields, in the order of `registry.status_fields`: the first object of the block."""
TABLE_INDICES: Final = {
    "good": 0x5F01,
    "writers_alive": 0x5F02,
    "owner": 0x5F10,
    "lease": 0x5F20,
    "age": 0x5F30,
    "quality": 0x5F40,
}
"""The first index of each table of `core.status_layout.TABLES`."""
MAX_ARRAY: Final = 254
"""Entries of one index."""
WORD_TYPES: Final = {1: CanType.UNSIGNED16, 2: CanType.UNSIGNED32}
"""By words of the block."""
_SUBINDICES: Final = {
    field.name: (number, WORD_TYPES[field.words])
    for number, field in enumerate(status_fields(), 1)
    if field.offset not in (REQUEST, RELEASE)
}

FIELD_NAMES: Final = tuple(_SUBINDICES)
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
    return StatusWord(name, HEADER, subindex, can_type)


def quality_word(variable: int, name: str) -> StatusWord:
    """The quality of the variable with that index and name."""
    further, member = divmod(variable, MAX_ARRAY)
    index = TABLE_INDICES["quality"] + further
    return StatusWord(f"quality of {name}", index, member + 1, CanType.UNSIGNED16, variable)
