"""The automatic layout of a node."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.pdo_layout import (
    FIRST_INDEX,
    OBJECT_BASES,
    PDO_BITS,
    Slot,
    assign,
    place_objects,
    split_into_pdos,
)
from gatewayd.links.canopen_node.plan import ObjectPlan

IN, OUT = Direction.INPUT, Direction.OUTPUT
TYPES = st.sampled_from(list(OBJECT_BASES))


def places(*variables: tuple[Direction, CanType]) -> list[str]:
    objects = place_objects((number, *variable) for number, variable in enumerate(variables))
    return [f"{one.index:04X}:{one.subindex:02X}" for one in objects]


def test_each_type_has_its_own_arrays_in_each_direction() -> None:
    """PLC programs are built on these numbers."""
    assert places(
        (IN, CanType.BOOLEAN),
        (IN, CanType.REAL64),
        (IN, CanType.BOOLEAN),
        (OUT, CanType.INTEGER32),
        (OUT, CanType.REAL32),
    ) == ["2000:01", "2020:01", "2000:02", "2410:01", "2430:01"]


def test_after_254_the_next_index_goes_on() -> None:
    found = places(*[(OUT, CanType.INTEGER32)] * 600)
    assert (found[253], found[254], found[508]) == ("2410:FE", "2411:01", "2412:01")


def test_arrays_of_the_largest_cell_do_not_meet() -> None:
    """1024 variables of one type take five indices; there are sixteen."""
    starts = sorted(
        FIRST_INDEX[direction] + base for direction in Direction for base in OBJECT_BASES.values()
    )
    assert min(after - before for before, after in pairwise(starts)) >= 1024 / 254


def objects(*types: CanType) -> list[ObjectPlan]:
    return list(place_objects((number, OUT, can_type) for number, can_type in enumerate(types)))


def test_bits_then_integers_then_reals_fill_pdos() -> None:
    mixed = [CanType.REAL64, CanType.INTEGER32, *[CanType.BOOLEAN] * 65, CanType.REAL32, CanType.INTEGER32]
    pdos = split_into_pdos(objects(*mixed))
    assert [[one.type for one in pdo] for pdo in pdos] == [
        [CanType.BOOLEAN] * 64,
        [CanType.BOOLEAN],
        [CanType.INTEGER32] * 2,
        [CanType.REAL64],
        [CanType.REAL32],
    ]


@given(st.lists(TYPES, max_size=200))
def test_every_object_is_in_one_pdo_that_holds_it(types: list[CanType]) -> None:
    """Byte-aligned unless they are bits, in the order of the file within a kind."""
    given_objects = objects(*types)
    pdos = split_into_pdos(given_objects)
    carried = [one for pdo in pdos for one in pdo]
    assert sorted(carried, key=lambda one: one.variable) == given_objects
    for pdo in pdos:
        offset = 0
        for one in pdo:
            assert one.type is CanType.BOOLEAN or offset % 8 == 0
            offset += one.type.bits
        assert 0 < offset <= PDO_BITS
        assert [one.variable for one in pdo] == sorted(one.variable for one in pdo)


def test_predefined_cob_ids_come_first_then_the_declared() -> None:
    assert assign([None] * 6, 16, [0x1A0, 0x1A1], transmit=True) == (
        Slot(1, 0x190, predefined=True),
        Slot(2, 0x290, predefined=True),
        Slot(3, 0x390, predefined=True),
        Slot(4, 0x490, predefined=True),
        Slot(5, 0x1A0, predefined=False),
        Slot(6, 0x1A1, predefined=False),
    )


def test_a_pdo_with_its_own_cob_id_takes_the_lowest_number_left() -> None:
    """The numbers of predefined COB-IDs are kept for who uses them."""
    assert assign([0x1C0], 16, [], transmit=True) == (Slot(1, 0x1C0, predefined=False),)
    assert assign([0x1C0, None], 16, [], transmit=False) == (
        Slot(2, 0x1C0, predefined=False),
        Slot(1, 0x210, predefined=True),
    )


def test_a_predefined_cob_id_that_is_written_out_has_its_own_number() -> None:
    """So that the data sheet can say `$NODEID+0x300` for RPDO 2."""
    assert assign([None, 0x310], 16, [], transmit=False) == (
        Slot(1, 0x210, predefined=True),
        Slot(2, 0x310, predefined=True),
    )


def test_missing_cob_ids_are_reported() -> None:
    found = assign([None] * 6, 16, [0x1A0], transmit=True)
    assert [slot.cob_id is None for slot in found] == [False] * 5 + [True]


@given(
    st.lists(st.one_of(st.none(), st.integers(0x181, 0x57F)), max_size=30),
    st.integers(1, 127),
    st.lists(st.integers(0x180, 0x6DF), max_size=30),
)
def test_numbers_and_given_cob_ids_are_unique(
    wanted: list[int | None], node: int, declared: list[int]
) -> None:
    """What was wished for stays; what was handed out is nobody else's."""
    slots = assign(wanted, node, declared, transmit=True)
    assert sorted(slot.number for slot in slots) == sorted({slot.number for slot in slots})
    for slot, wish in zip(slots, wanted, strict=True):
        assert wish is None or slot.cob_id == wish
    handed = [
        slot.cob_id
        for slot, wish in zip(slots, wanted, strict=True)
        if wish is None and slot.cob_id is not None
    ]
    assert len(handed) == len(set(handed))
    assert not set(handed) & {wish for wish in wanted if wish is not None}


@pytest.mark.parametrize("transmit", [True, False])
def test_numbers_have_no_gaps_beyond_the_predefined(transmit: bool) -> None:
    slots = assign([0x1C0, 0x1C1, 0x1C2, 0x1C3, 0x1C4], 16, [], transmit=transmit)
    assert [slot.number for slot in slots] == [1, 2, 3, 4, 5]
