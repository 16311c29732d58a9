"""The automatic layout of a CANopen node: objects by type, PDOs, and their numbers and COB-IDs.

Pure and deterministic: the same variables in the same order always lie in the same place.

Objects. Each CiA 301 type has arrays of its own from `2000h + OBJECT_BASES[type]` on (towards the robot) and 400h
higher (from the robot), filled in the order of the file from sub-index 1; after sub-index 254 the next index goes on.
PDOs. Bits are packed 64 to a PDO; then integers, then reals fill PDOs of 64 bits in the order of the file.
COB-IDs. A PDO without one of its own takes the lowest free predefined one (PDO 1 to 4, it follows the node-ID), then
the next of the declared ones. PDOs with a COB-ID that is not predefined take the lowest numbers that are left.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Final

from gatewayd.canopen.cob_ids import predefined_pdo
from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.plan import ObjectPlan

FIRST_INDEX: Final = {Direction.INPUT: 0x2000, Direction.OUTPUT: 0x2400}
"""Where the variables of a direction begin in the object dictionary."""
OBJECT_BASES: Final = {
    CanType.BOOLEAN: 0x00,
    CanType.INTEGER32: 0x10,
    CanType.REAL64: 0x20,
    CanType.REAL32: 0x30,
    CanType.UNSIGNED32: 0x40,
    CanType.UNSIGNED8: 0x50,
    CanType.INTEGER16: 0x60,
    CanType.UNSIGNED16: 0x70,
    CanType.INTEGER8: 0x80,
    CanType.INTEGER64: 0x90,
    CanType.UNSIGNED64: 0xA0,
}
"""Where the arrays of a type begin within a direction; 16 indices each."""
PDO_BITS: Final = 64
"""Greatest length of a PDO."""
PDO_NUMBERS: Final = 512
"""PDOs that a node can have in one direction (CiA 301, 7.4.8)."""

_LAST_SUBINDEX: Final = 254
_PREDEFINED: Final = 4


def place_objects(variables: Iterable[tuple[int, Direction, CanType]]) -> tuple[ObjectPlan, ...]:
    """Give each variable (its index, direction and type) its object, in the order given."""
    counts: dict[tuple[Direction, CanType], int] = {}
    placed = []
    for variable, direction, can_type in variables:
        before = counts.get((direction, can_type), 0)
        counts[direction, can_type] = before + 1
        further, member = divmod(before, _LAST_SUBINDEX)
        index = FIRST_INDEX[direction] + OBJECT_BASES[can_type] + further
        placed.append(ObjectPlan(variable, index, member + 1, can_type))
    return tuple(placed)


def split_into_pdos(objects: Sequence[ObjectPlan]) -> list[tuple[ObjectPlan, ...]]:
    """Spread the objects of one direction over PDOs: bits, integers and reals apart, each in the order given."""
    bits = [item for item in objects if item.type is CanType.BOOLEAN]
    reals = [item for item in objects if item.type.is_real]
    integers = [item for item in objects if item.type is not CanType.BOOLEAN and not item.type.is_real]
    return [pdo for group in (bits, integers, reals) for pdo in _filled(group)]


def _filled(objects: Sequence[ObjectPlan]) -> list[tuple[ObjectPlan, ...]]:
    """Fill one PDO after the other; nothing is moved forward into a gap, so that the order stays."""
    pdos: list[list[ObjectPlan]] = []
    room = 0
    for item in objects:
        if item.type.bits > room:
            pdos.append([])
            room = PDO_BITS
        pdos[-1].append(item)
        room -= item.type.bits
    return [tuple(pdo) for pdo in pdos]


@dataclass(frozen=True, slots=True)
class Slot:
    """What identifies a PDO on the bus and in the object dictionary."""

    number: int
    """From 1 within its direction; beyond `PDO_NUMBERS` there is no object for it."""
    cob_id: int | None
    """None: there is none left."""
    predefined: bool
    """The COB-ID is that of the predefined connection set for this number and node-ID."""


def assign(
    wanted: Sequence[int | None], node: int, declared: Iterable[int], *, transmit: bool
) -> tuple[Slot, ...]:
    """Number PDOs and give those without a COB-ID of their own (None in `wanted`) one, in the order given."""
    own = {cob_id for cob_id in wanted if cob_id is not None}
    predefined = {
        number: cob_id
        for number in range(1, _PREDEFINED + 1)
        if (cob_id := predefined_pdo(number, node, transmit=transmit)) is not None
    }
    by_cob_id = {cob_id: number for number, cob_id in predefined.items()}
    numbers: dict[int, int] = {}
    """Position -> number of a predefined COB-ID."""
    for position, cob_id in enumerate(wanted):
        if cob_id in by_cob_id and by_cob_id[cob_id] not in numbers.values():
            numbers[position] = by_cob_id[cob_id]
    free = (number for number, cob_id in predefined.items() if cob_id not in own)
    without = (position for position, cob_id in enumerate(wanted) if cob_id is None)
    numbers.update(zip(without, free, strict=False))
    pool = (cob_id for cob_id in dict.fromkeys(declared) if cob_id not in own and cob_id not in by_cob_id)
    taken = set(numbers.values())
    left = (number for number in count(1) if number not in taken)
    slots: list[Slot] = []
    for position, cob_id in enumerate(wanted):
        if position in numbers:
            slots.append(Slot(numbers[position], predefined[numbers[position]], predefined=True))
        else:
            found = next(pool, None) if cob_id is None else cob_id
            slots.append(Slot(next(left), found, predefined=False))
    return tuple(slots)
