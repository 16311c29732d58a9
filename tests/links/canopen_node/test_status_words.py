"""The words of the status block in a TPDO are those that the object dictionary serves."""

from __future__ import annotations

from gatewayd.core import status_layout as status
from gatewayd.links.canopen_node.status_words import (
    FIELD_NAMES,
    HEADER,
    TABLE_INDICES,
    field_word,
    quality_word,
)
from gatewayd.links.registry import status_fields


def test_fields_are_those_of_the_status_block() -> None:
    """Names, sub-indices and lengths are those of the block."""
    for subindex, field in enumerate(status_fields(), 1):
        if field.offset in (status.REQUEST, status.RELEASE):
            assert field.name not in FIELD_NAMES
            continue
        word = field_word(field.name)
        assert (word.index, word.subindex) == (HEADER, subindex)
        assert word.type.bits == 16 * field.words
    readable = [
        field.name for field in status_fields() if field.offset not in (status.REQUEST, status.RELEASE)
    ]
    assert list(FIELD_NAMES)[: len(readable)] == readable


def test_qualities_lie_where_the_table_does() -> None:
    """254 to an index, as CANopen arrays end."""
    first = TABLE_INDICES["quality"]
    places = [(word.index, word.subindex) for word in (quality_word(n, "x") for n in (0, 253, 254, 508))]
    assert places == [(first, 1), (first, 254), (first + 1, 1), (first + 2, 1)]
    assert quality_word(3, "recipe[3]").name == "quality of recipe[3]"
