from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, ValueKind
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.registers import RegisterImage
from gatewayd.modbus.areas import MAX_READ_BITS, MAX_READ_REGISTERS, Area
from tests.links.modbus_server.conftest import Sketch, make_cell, make_plan

IndexOf = Callable[[str], int]


def test_gaps_can_read_as_zero(cell: Cell, plan_of: Callable[..., ModbusPlan]) -> None:
    """From 0 to 59999, so that a client may read in blocks of its own; only for reading."""
    image = RegisterImage(plan_of(fill_gaps=True), cell)
    for table in (image.holding, image.input):
        reach = table.readable.reach
        assert (reach[0], reach[502], reach[59_875]) == (MAX_READ_REGISTERS,) * 3
        assert (reach[59_876], reach[59_999], reach[60_000]) == (124, 1, 0)
    for bits in (image.coils, image.discrete):
        reach = bits.readable.reach
        assert (reach[0], reach[58_000], reach[58_001], reach[60_000]) == (
            MAX_READ_BITS,
            MAX_READ_BITS,
            1999,
            0,
        )
        assert bits.read(50_000, 9) == bytes(2)
    assert image.holding.changes(18, bytes(2)) == Refusal(Reason.NO_SUCH_ADDRESS)
    assert image.coils.changes(11, [False]) == Refusal(Reason.NO_SUCH_ADDRESS)


def test_gaps_are_filled_where_a_client_has_something_to_read(
    cell: Cell, plan_of: Callable[..., ModbusPlan]
) -> None:
    """The status block is in both tables of registers; coils and discrete inputs that nobody mapped stay absent."""
    plan = plan_of(fill_gaps=True)
    coils = tuple(placement for placement in plan.placements if placement.area is Area.COIL)
    image = RegisterImage(replace(plan, placements=coils), cell)
    tables = (image.holding, image.input, image.coils, image.discrete)
    assert [table.readable.reach[0] > 0 for table in tables] == [True, True, True, False]


def test_a_gap_that_is_filled_is_not_held_back(cell: Cell, plan_of: Callable[..., ModbusPlan]) -> None:
    image = RegisterImage(plan_of(fill_gaps=True), cell)
    cell.robot_lost("cable", 1001.0)
    reach = image.holding.readable.reach
    assert (reach[0], reach[290], reach[299], reach[300], reach[301]) == (125, 10, 1, 0, 125)


def test_shows_what_the_robot_tells(unit: Unit, show: Callable[..., None]) -> None:
    show(int_0=-2, int_1=7, real_0=1.5, bit_0=True, bit_17=True, swapped=1.5, clipped=1e9, fragile=9)
    holding, image = unit.image.holding.image, unit.image
    assert holding[200:208] == struct.pack(">ii", -2, 7)
    assert image.input.image[:8] == struct.pack(">ii", -2, 7)
    assert holding[400:408] == struct.pack(">d", 1.5)
    assert holding[1000:1004] == bytes.fromhex("0001 0002")
    assert image.discrete.read(3, 32) == bytes.fromhex("01 00 02 00")
    assert holding[602:606] == bytes.fromhex("0000 3fc0"), "words swapped"
    assert holding[606:608] == bytes.fromhex("7fff"), "saturated"
    assert holding[600:602] == bytes.fromhex("0009")


def test_what_the_robot_no_longer_tells_is_cleared_or_held_back(
    cell: Cell, unit: Unit, show: Callable[..., None]
) -> None:
    show(int_0=7, fragile=9)
    holding = unit.image.holding
    assert holding.readable.reach[300] == 4
    cell.robot_lost("cable", 1001.0)
    holding = unit.image.holding
    assert holding.image[200:204] == bytes(4)
    assert (holding.readable.reach[300], holding.readable.reach[301]) == (0, 3)
    assert unit.image.discrete.readable.reach[40] == 0
    assert holding.readable.mapped[300] == 4


def test_a_register_with_bits_of_both_directions_shows_both(
    cell: Cell, unit: Unit, show: Callable[..., None], index_of: IndexOf
) -> None:
    show(other_half=True)
    assert unit.image.holding.image[40:42] == bytes.fromhex("0002")
    assert cell.write(Requester(0), [Change(index_of("half"), value=True)], 1000.0) is None
    assert unit.image.holding.image[40:42] == bytes.fromhex("0003")
    show(other_half=False)
    assert unit.image.holding.image[40:42] == bytes.fromhex("0001")


def test_follows_its_cell_until_closed(cell: Cell, unit: Unit, show: Callable[..., None]) -> None:
    unit.close()
    unit.close()
    assert not cell.listeners
    show(int_0=7)
    assert unit.image.holding.image[200:204] == bytes(4)


def test_a_write_is_a_list_of_whole_variables(unit: Unit, index_of: IndexOf) -> None:
    data = struct.pack(">Hih", 5, -6, 75)
    assert unit.image.holding.changes(10, data) == [
        Change(index_of("part"), 5),
        Change(index_of("count"), -6),
        Change(index_of("force"), 7.5),
    ]


@pytest.mark.parametrize(
    "case",
    [
        (11, 1, Reason.PARTIAL_VALUE, "count"),
        (12, 1, Reason.PARTIAL_VALUE, "count"),
        (10, 2, Reason.PARTIAL_VALUE, "count"),
        (15, 2, Reason.PARTIAL_VALUE, "speed"),
        (17, 2, Reason.NO_SUCH_ADDRESS, None),
        (99, 2, Reason.NO_SUCH_ADDRESS, None),
        (100, 2, Reason.NOT_WRITABLE, "int_0"),
        (101, 1, Reason.NOT_WRITABLE, "int_0"),
        (500, 1, Reason.NOT_WRITABLE, "bit_0"),
        (65535, 2, Reason.NO_SUCH_ADDRESS, None),
    ],
)
def test_a_write_that_can_never_be_is_refused(
    unit: Unit, index_of: IndexOf, case: tuple[int, int, Reason, str | None]
) -> None:
    address, words, reason, variable = case
    expected = Refusal(reason, index_of(variable) if variable is not None else None)
    assert unit.image.holding.changes(address, bytes(2 * words)) == expected


def test_bits_of_a_written_register_are_implied(unit: Unit, index_of: IndexOf) -> None:
    assert unit.image.holding.changes(0, bytes.fromhex("8001")) == [
        Change(index_of("start"), value=True, implied=True),
        Change(index_of("stop"), value=False, implied=True),
        Change(index_of("mode"), value=True, implied=True),
    ]


@pytest.mark.parametrize("word", [0x0004, 0x4000, 0x8003 | 0x7FFC])
def test_a_one_for_an_unmapped_bit_is_refused(unit: Unit, word: int) -> None:
    """As a register or a coil without a variable is: it would be acknowledged and lost."""
    assert unit.image.holding.changes(0, word.to_bytes(2, "big")) == Refusal(Reason.NO_SUCH_ADDRESS)


@pytest.mark.parametrize(
    "masks",
    [(0xFFFB, 0x0004), (0xFFFA, 0x0005), (0xFFFB, 0x0000), (0x8003, 0x0000), (0x0000, 0xFFFF)],
    ids=["unmapped", "a one beside a mapped one", "zero in unmapped", "all unmapped", "the whole register"],
)
def test_a_mask_that_would_be_lost_is_refused(unit: Unit, masks: tuple[int, int]) -> None:
    assert unit.image.holding.masked(0, *masks) == Refusal(Reason.NO_SUCH_ADDRESS)


def test_a_mask_may_clear_unmapped_bits_beside_mapped_ones(unit: Unit, index_of: IndexOf) -> None:
    """They are 0 and stay so: nothing is lost."""
    start, stop, mode = (index_of(name) for name in ("start", "stop", "mode"))
    assert unit.image.holding.masked(0, 0x0000, 0x8001) == [
        Change(start, value=True), Change(stop, value=False), Change(mode, value=True),
    ]  # fmt: skip


def test_gaps_can_be_written_without_effect(
    cell: Cell, plan_of: Callable[..., ModbusPlan], index_of: IndexOf
) -> None:
    """For clients that write whole blocks; a write that meets nothing mapped is refused."""
    image = RegisterImage(replace(plan_of(), ignore_gaps=True), cell)
    holding, coils = image.holding, image.coils
    assert holding.changes(9, bytes.fromhex("0001 0002")) == [Change(index_of("part"), 2)]
    assert holding.changes(17, struct.pack(">4H", 0, 1, 2, 1)) == Refusal(
        Reason.PARTIAL_VALUE, index_of("speed")
    )
    assert holding.changes(18, struct.pack(">3H", 1, 2, 1)) == [
        Change(index_of("half"), value=True),
        Change(index_of("other_half"), value=False, implied=True),
    ]
    assert holding.changes(0, bytes.fromhex("0005"))[0] == Change(index_of("start"), value=True, implied=True)  # type: ignore[index]  # a list
    assert holding.masked(0, 0xFFFA, 0x0005) == [Change(index_of("start"), value=True)]
    assert coils.changes(9, [True]) == [Change(index_of("coil_9"), value=True)]
    assert coils.changes(10, [True, True])[1:] == []  # type: ignore[index]  # a list
    nothing = Refusal(Reason.NO_SUCH_ADDRESS)
    assert holding.changes(1, bytes(18)) == nothing
    assert holding.masked(0, 0xFFFB, 0x0004) == nothing
    assert holding.masked(1, 0, 0xFFFF) == nothing
    assert coils.changes(11, [True] * 9) == nothing
    assert holding.changes(99, bytes(6)) == Refusal(Reason.NOT_WRITABLE, index_of("int_0")), "not a gap"


def test_the_status_block_is_no_gap(sketch: Sketch) -> None:
    """A request or a release of a lock is carried out or refused, never let pass."""
    sketch.number(sketch.input("last", ValueKind.INT), Area.HOLDING, 59_999, "uint16")
    changed = make_cell(sketch)
    image = RegisterImage(replace(make_plan(sketch), ignore_gaps=True), changed)
    assert isinstance(image.holding.changes(59_998, bytes(4)), list)
    assert image.holding.changes(59_999, bytes(4)) == Refusal(Reason.NO_SUCH_ADDRESS)


def test_what_was_ignored_is_counted(cell: Cell, plan_of: Callable[..., ModbusPlan]) -> None:
    image = RegisterImage(replace(plan_of(), ignore_gaps=True), cell)
    assert image.holding.ignored(9, bytes.fromhex("0000 0002")) == 1
    assert image.holding.ignored(0, bytes.fromhex("c00f 0000")) == 4, "three ones of bits and a register"
    assert image.coils.ignored(8, 5) == 2


def test_bits_selected_by_a_mask_are_meant(unit: Unit, index_of: IndexOf) -> None:
    assert unit.image.holding.masked(0, 0x7FFE, 0x8000) == [
        Change(index_of("start"), value=False),
        Change(index_of("mode"), value=True),
    ]


@pytest.mark.parametrize(
    "and_mask,or_mask", [(0x00F2, 0x0025), (0, 0xFFFF), (0xFFFF, 0x1234), (0x5555, 0xFFFF)]
)
def test_a_mask_on_a_number_follows_the_formula(
    cell: Cell, unit: Unit, index_of: IndexOf, and_mask: int, or_mask: int
) -> None:
    assert cell.write(Requester(0), [Change(index_of("part"), 0x0012)], 1000.0) is None
    expected = (0x0012 & and_mask) | (or_mask & ~and_mask & 0xFFFF)
    assert unit.image.holding.masked(10, and_mask, or_mask) == [Change(index_of("part"), expected)]


@pytest.mark.parametrize(
    "address,reason", [(1, Reason.NO_SUCH_ADDRESS), (11, Reason.PARTIAL_VALUE), (500, Reason.NOT_WRITABLE)]
)
def test_a_mask_that_can_never_be_is_refused(unit: Unit, address: int, reason: Reason) -> None:
    refusal = unit.image.holding.masked(address, 0, 0)
    assert isinstance(refusal, Refusal)
    assert refusal.reason is reason


def test_coils_are_written_one_by_one(unit: Unit, index_of: IndexOf) -> None:
    assert unit.image.coils.changes(8, [True, False]) == [
        Change(index_of("coil_8"), value=True),
        Change(index_of("coil_9"), value=False),
    ]
    assert unit.image.coils.changes(10, [True, False]) == Refusal(Reason.NO_SUCH_ADDRESS)


def test_an_input_is_shown_after_it_was_written(cell: Cell, unit: Unit, index_of: IndexOf) -> None:
    assert (
        cell.write(
            Requester(0), [Change(index_of("count"), -2), Change(index_of("coil_3"), value=True)], 1000.0
        )
        is None
    )
    assert unit.image.holding.image[22:26] == struct.pack(">i", -2)
    assert unit.image.coils.read(0, 10) == bytes.fromhex("08 00")


@pytest.mark.parametrize("direction", list(Direction))
def test_refreshing_what_did_not_change_changes_nothing(unit: Unit, direction: Direction) -> None:
    before = bytes(unit.image.holding.image)
    unit.image.changed.add(direction)
    assert unit.image.holding.image == before
