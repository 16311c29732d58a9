"""Changing PDOs by SDO: the order that CiA 301 demands, and the abort codes of everything else.

Tests named `test_pdo_NN` are the cases of the CiA conformance test of that number, at the level of the dictionary.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.canopen.cob_ids import is_restricted
from gatewayd.canopen.dictionary import Abort, AbortCode
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.pdo.codec import is_aligned
from gatewayd.links.canopen_node.pdo.parameters import PdoTable
from gatewayd.links.canopen_node.plan import PdoPlan

Bench = Any
"""`Bench` of conftest.py, which cannot be imported."""

INVALID = 0x8000_0000
NO_RTR = 0x4000_0000
UNSUPPORTED, INVALID_VALUE = AbortCode.UNSUPPORTED_ACCESS, AbortCode.INVALID_VALUE
NOT_MAPPABLE, NO_OBJECT, PDO_LENGTH = AbortCode.NOT_MAPPABLE, AbortCode.NO_OBJECT, AbortCode.PDO_LENGTH

DIRECTIONS = pytest.mark.parametrize("direction", list(Direction))


class Case:
    """One direction of a table with one mapped PDO of it, number 1."""

    def __init__(self, bench: Bench, direction: Direction) -> None:
        is_input = direction is Direction.INPUT
        self.bench = bench
        self.direction = direction
        self.prefix = "in" if is_input else "out"
        self.communication, self.mapping = (0x1400, 0x1600) if is_input else (0x1800, 0x1A00)
        self.cob_id = 0x205 if is_input else 0x185
        self.flags = 0 if is_input else NO_RTR
        self.table: PdoTable = bench.table(
            bench.pdo(direction, 1, *self.names("int_0", "int_1"), predefined=True)
        )

    def names(self, *names: str) -> list[str]:
        return [name if name.startswith("dummy") else f"{self.prefix}_{name}" for name in names]

    def entry(self, name: str) -> int:
        one = self.bench.entry(*self.names(name))
        return int(one.index << 16 | one.subindex << 8 | one.bits)

    def com(self, subindex: int, value: int) -> AbortCode | None:
        return self.bench.write(self.communication, subindex, value)  # type: ignore[no-any-return]  # see Bench

    def map(self, subindex: int, value: int) -> AbortCode | None:
        return self.bench.write(self.mapping, subindex, value)  # type: ignore[no-any-return]  # see Bench

    def open(self) -> None:
        """Make PDO 1 invalid and its mapping empty."""
        assert self.com(1, self.cob_id | INVALID) is None
        assert self.map(0, 0) is None

    def remap(self, *names: str) -> AbortCode | None:
        self.open()
        for position, name in enumerate(names, 1):
            abort = self.map(position, self.entry(name))
            if abort is not None:
                return abort
        return self.map(0, len(names))

    @property
    def configuration(self) -> Any:
        return self.bench.configurations.get((self.direction, 1))


@pytest.fixture(params=list(Direction), ids=["rpdo", "tpdo"])
def case(bench: Bench, request: pytest.FixtureRequest) -> Case:
    return Case(bench, request.param)


# -- what is there after power-on --------------------------------------------------------------------------------


def test_defaults_follow_the_plan_and_the_node(case: Case) -> None:
    read = case.bench.read
    assert read(case.communication, 1) == case.cob_id | case.flags
    assert read(case.communication, 2) == 255
    assert read(case.mapping, 0) == 2
    assert read(case.mapping, 1) == case.entry("int_0")
    assert read(case.mapping, 3) == 0
    assert case.configuration.can_id == case.cob_id
    assert case.configuration.layout.size == 8


def test_spare_pdos_are_there_and_invalid(case: Case) -> None:
    assert len(case.table.pdos) == 8
    assert case.bench.read(case.communication + 3, 1) == case.cob_id + 0x300 | case.flags | INVALID
    assert case.bench.read(case.mapping + 3, 0) == 0
    assert (case.direction, 4) not in case.bench.configurations


def test_pdos_beyond_the_fourth_have_no_identifier_until_one_is_written(bench: Bench) -> None:
    seventh = bench.pdo(Direction.INPUT, 7, "in_real_0", cob_id=0x210)
    bench.table(bench.pdo(Direction.OUTPUT, 6, "out_real_0", cob_id=0x1B0), seventh)
    assert bench.read(0x1804, 1) == INVALID | NO_RTR
    assert bench.read(0x1805, 1) == 0x1B0 | NO_RTR
    assert bench.read(0x1405, 1) == INVALID
    assert bench.configurations[Direction.OUTPUT, 6].can_id == 0x1B0


def test_sub_4_and_what_the_direction_does_not_have_are_absent(bench: Bench) -> None:
    bench.table()
    with pytest.raises(Abort) as caught:
        bench.dictionary.read(0x1800, 4)
    assert caught.value.code is AbortCode.NO_SUBINDEX
    assert [entry.subindex for entry in bench.dictionary._objects[0x1800].entries] == [0, 1, 2, 3, 5, 6]
    assert [entry.subindex for entry in bench.dictionary._objects[0x1400].entries] == [0, 1, 2, 5]
    assert bench.read(0x1800, 0) == 6
    assert bench.read(0x1400, 0) == 5


def test_only_identifiers_that_follow_the_node_say_so(bench: Bench) -> None:
    bench.table(bench.pdo(Direction.OUTPUT, 1, "out_real_0", cob_id=0x1B0))
    assert not bench.dictionary.entry(0x1800, 1).plus_node
    assert bench.dictionary.entry(0x1801, 1).plus_node


def test_all_parameters_are_stored(bench: Bench) -> None:
    table = bench.table()
    entries = [entry for one in table.objects() for entry in one.entries if entry.access.writable]
    assert len(entries) == 4 * (3 + 65) + 4 * (5 + 65)
    assert all(entry.stored for entry in entries)


# -- communication parameters ------------------------------------------------------------------------------------


def test_pdo_03_identifier_of_a_valid_pdo_cannot_be_changed(case: Case) -> None:
    assert case.com(1, case.cob_id + 1 | case.flags) is INVALID_VALUE
    assert case.com(1, case.cob_id | case.flags) is None
    assert case.configuration.can_id == case.cob_id


def test_pdo_can_be_made_invalid_and_valid_again_with_another_identifier(case: Case) -> None:
    assert case.com(1, case.cob_id | case.flags | INVALID) is None
    assert (case.direction, 1) in case.bench.configurations
    assert not case.configuration
    assert case.com(1, 0x333 | case.flags) is None
    assert case.configuration.can_id == 0x333


def test_29_bit_and_overlong_identifiers_are_refused(case: Case) -> None:
    case.com(1, case.cob_id | INVALID)
    assert case.com(1, 0x2000_0333) is INVALID_VALUE
    assert case.com(1, 0xA000_0333) is INVALID_VALUE
    assert case.com(1, 0x0000_0800) is INVALID_VALUE


@pytest.mark.parametrize(
    "can_id", [0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x6E0, 0x701, 0x7FF]
)
def test_testing_other_10_restricted_identifiers_are_refused(case: Case, can_id: int) -> None:
    case.com(1, case.cob_id | INVALID)
    assert case.com(1, can_id) is INVALID_VALUE
    assert case.com(1, can_id | INVALID) is None, "an invalid PDO may hold any"
    assert case.configuration is None


def test_a_tpdo_that_remote_frames_may_ask_for_is_refused(bench: Bench) -> None:
    """They are not answered. Made invalid it may be without the bit, as many masters write it."""
    case = Case(bench, Direction.OUTPUT)
    assert case.com(1, case.cob_id) is INVALID_VALUE
    assert case.com(1, INVALID | case.cob_id) is None
    assert case.com(1, case.cob_id) is INVALID_VALUE
    assert case.com(1, NO_RTR | case.cob_id) is None
    assert case.configuration.can_id == case.cob_id


def test_pdo_without_a_mapping_cannot_be_made_valid(case: Case) -> None:
    case.open()
    assert case.com(1, case.cob_id) is INVALID_VALUE


def test_two_tpdos_never_share_an_identifier_and_two_rpdos_may(bench: Bench) -> None:
    case = Case(bench, Direction.OUTPUT)
    assert bench.write(0x1A01, 1, case.entry("int_2")) is None
    assert bench.write(0x1A01, 0, 1) is None
    assert bench.write(0x1801, 1, NO_RTR | 0x185) is INVALID_VALUE
    assert bench.write(0x1801, 1, NO_RTR | 0x285) is None
    case = Case(bench, Direction.INPUT)
    assert bench.write(0x1601, 1, case.entry("int_2")) is None
    assert bench.write(0x1601, 0, 1) is None
    assert bench.write(0x1401, 1, 0x205) is None


def test_pdo_04_reserved_transmission_types_are_refused(case: Case) -> None:
    """241-251 are reserved; 252 and 253 are answers to remote frames, which this node does not give."""
    for value in range(256):
        expected = None if value <= 240 or value >= 254 else INVALID_VALUE
        assert case.com(2, value) is expected, value
    assert case.configuration.transmission == 255


def test_transmission_type_and_event_timer_change_while_valid(case: Case) -> None:
    assert case.com(2, 1) is None
    assert case.com(5, 250) is None
    assert case.configuration.transmission == 1
    assert case.configuration.event == 0.25


def test_inhibit_time_and_sync_start_change_only_while_invalid(bench: Bench) -> None:
    case = Case(bench, Direction.OUTPUT)
    assert case.com(3, 100) is INVALID_VALUE
    assert case.com(6, 3) is INVALID_VALUE
    case.com(1, case.cob_id | INVALID)
    assert case.com(3, 100) is None
    assert case.com(6, 241) is INVALID_VALUE
    assert case.com(6, 240) is None
    case.com(1, case.cob_id | case.flags)
    assert case.configuration.inhibit == 0.01
    assert case.configuration.sync_start == 240


# -- mapping -----------------------------------------------------------------------------------------------------


def test_pdo_21_mapping_can_be_switched_off_and_on(case: Case) -> None:
    case.com(1, case.cob_id | INVALID)
    assert case.map(0, 0) is None
    assert case.map(0, 2) is None
    assert case.com(1, case.cob_id | case.flags) is None
    assert case.configuration.layout.size == 8


def test_pdo_22_pdo_can_be_mapped_anew(case: Case) -> None:
    assert case.remap("short_0", "single_1", "short_2") is None
    assert case.com(1, case.cob_id | case.flags) is None
    expected = [case.bench.by_name[name] for name in case.names("short_0", "single_1", "short_2")]
    assert list(case.configuration.layout.variables) == expected


def test_pdo_23_number_of_mapped_objects_while_valid_is_refused(case: Case) -> None:
    assert case.map(0, 0) is UNSUPPORTED
    assert case.map(0, 1) is UNSUPPORTED
    assert case.bench.read(case.mapping, 0) == 2


def test_pdo_24_mapped_object_while_valid_or_counted_is_refused(case: Case) -> None:
    assert case.map(1, case.entry("int_3")) is UNSUPPORTED
    case.com(1, case.cob_id | INVALID)
    assert case.map(1, case.entry("int_3")) is UNSUPPORTED
    assert case.bench.read(case.mapping, 1) == case.entry("int_0")


def test_pdo_25_more_objects_than_set_or_possible_are_refused(case: Case) -> None:
    case.open()
    assert case.map(0, 3) is NOT_MAPPABLE
    assert case.map(0, 65) is PDO_LENGTH
    assert case.bench.read(case.mapping, 0) == 0


def test_pdo_26_more_than_64_bits_are_refused(case: Case) -> None:
    assert case.remap("real_0", "bit_0") is PDO_LENGTH
    assert case.remap("int_0", "int_1", "short_0") is PDO_LENGTH
    assert case.com(1, case.cob_id | case.flags) is INVALID_VALUE


@pytest.mark.parametrize("bits", [1, 16, 31, 64])
def test_pdo_27_length_must_be_that_of_the_object(case: Case, bits: int) -> None:
    case.open()
    assert case.map(1, case.entry("int_0") & ~0xFF | bits) is NOT_MAPPABLE


def test_pdo_28_length_beyond_a_frame_is_refused(case: Case) -> None:
    case.open()
    assert case.map(1, case.entry("int_0") & ~0xFF | 72) is PDO_LENGTH


def test_pdo_29_object_that_does_not_exist_is_refused(case: Case) -> None:
    case.open()
    assert case.map(1, 0x5555_00_08) is NO_OBJECT
    assert case.map(1, (case.entry("int_0") & ~0xFF00) | 0xFE00) is NO_OBJECT
    assert case.bench.read(case.mapping, 1) == case.entry("int_0")


def test_pdo_30_64_booleans_fill_a_pdo(case: Case) -> None:
    assert case.remap(*(f"bit_{position}" for position in range(64))) is None
    assert case.com(1, case.cob_id | case.flags) is None
    assert case.configuration.layout.size == 8


def test_pdo_31_only_booleans_lie_off_a_byte_boundary(case: Case) -> None:
    assert case.remap("bit_0", "bit_1", "short_0") is NOT_MAPPABLE
    assert case.remap("short_0", "bit_0", "bit_1") is None


def test_pdo_32_object_that_is_not_mappable_is_refused(case: Case) -> None:
    case.open()
    assert case.map(1, 0x5F00_01_20) is NOT_MAPPABLE
    assert case.map(1, case.communication << 16 | 0x01_20) is NOT_MAPPABLE


def test_object_of_the_other_direction_is_refused(case: Case) -> None:
    case.open()
    other = "out" if case.prefix == "in" else "in"
    one = case.bench.entry(f"{other}_int_0")
    assert case.map(1, one.index << 16 | one.subindex << 8 | one.bits) is NOT_MAPPABLE


@pytest.mark.parametrize("index, bits", [(2, 8), (3, 16), (4, 32), (5, 8), (6, 16), (7, 32)])
def test_pdo_33_dummies_fill_gaps_of_rpdos_only(bench: Bench, index: int, bits: int) -> None:
    rpdo = Case(bench, Direction.INPUT)
    assert rpdo.remap(f"dummy_{index}", "int_0") is None
    assert rpdo.com(1, rpdo.cob_id) is None
    assert rpdo.configuration.layout.size == bits // 8 + 4
    rpdo.open()
    assert rpdo.map(1, index << 16 | bits + 8) is NOT_MAPPABLE
    tpdo = Case(bench, Direction.OUTPUT)
    tpdo.open()
    assert tpdo.map(1, index << 16 | bits) is NO_OBJECT


def test_types_that_are_no_dummies_are_refused(bench: Bench) -> None:
    case = Case(bench, Direction.INPUT)
    case.open()
    assert case.map(1, 0x0001_00_01) is NO_OBJECT
    assert case.map(1, 0x0011_00_40) is NO_OBJECT


def test_entry_can_be_unset(case: Case) -> None:
    case.open()
    assert case.map(1, 0) is None
    assert case.map(0, 1) is NOT_MAPPABLE


# -- defaults and stored values ----------------------------------------------------------------------------------


def test_restore_puts_the_plan_back(case: Case) -> None:
    before = case.configuration
    case.remap("short_0")
    case.com(2, 1)
    case.com(1, 0x333)
    assert case.configuration != before
    case.table.restore()
    assert case.configuration == before
    assert case.bench.read(case.mapping, 0) == 2


def test_restore_for_another_node_moves_what_follows_the_node(case: Case) -> None:
    case.table.restore(node=9)
    assert case.configuration.can_id == case.cob_id + 4
    assert case.bench.dictionary.entry(case.communication, 1).default[0] == (case.cob_id + 4) & 0xFF


def test_only_changes_are_reported(case: Case) -> None:
    reported = case.bench.changes
    case.com(2, 255)
    case.com(1, case.cob_id | case.flags)
    case.table.restore()
    assert case.bench.changes == reported
    case.com(1, case.cob_id | INVALID)
    case.map(0, 0)
    assert case.bench.changes == reported + 1


def _values(table: PdoTable) -> dict[tuple[int, int], bytes]:
    return {(one.index, entry.subindex): entry.value for one in table.objects() for entry in one.entries}


def _put(bench: Bench, values: dict[tuple[int, int], bytes]) -> None:
    for (index, subindex), value in values.items():
        bench.dictionary.entry(index, subindex).value = value


def test_reload_takes_stored_values_over(case: Case) -> None:
    case.remap("short_0")
    case.com(1, 0x333)
    stored, wanted = _values(case.table), case.configuration
    case.table.restore()
    _put(case.bench, stored)
    assert case.table.reload() == []
    assert case.configuration == wanted


@pytest.mark.parametrize(
    "subindex, value",
    [(1, b"\x00\x08\x00\x00"), (1, b"\x80\x05\x00\x00"), (1, b"\x01\x00"), (2, b"\xfd"), (2, b"")],
)
def test_reload_replaces_what_could_not_have_been_written(case: Case, subindex: int, value: bytes) -> None:
    before = case.configuration
    _put(case.bench, {(case.communication, subindex): value, (case.mapping, 0): b"\x01"})
    broken = case.table.reload()
    assert broken == [case.communication] or value == b"\x80\x05\x00\x00"
    if broken:
        assert case.configuration == before


def test_reload_replaces_a_mapping_that_is_none(case: Case) -> None:
    _put(case.bench, {(case.mapping, 2): b"\x08\x00\x55\x55"})
    assert case.table.reload() == [case.communication]
    assert case.bench.read(case.mapping, 2) == case.entry("int_1")


def test_reload_never_leaves_two_tpdos_with_one_identifier(bench: Bench) -> None:
    """TPDO 1 has stored the identifier that the broken TPDO 2 goes back to."""
    table = bench.table(
        bench.pdo(Direction.OUTPUT, 1, "out_int_0"), bench.pdo(Direction.OUTPUT, 2, "out_int_1")
    )
    _put(bench, {(0x1800, 1): b"\x85\x02\x00\x00", (0x1801, 1): b"\x33\x03\x00\x00", (0x1801, 2): b"\xfd"})
    assert table.reload() == [0x1800, 0x1801]
    assert {pdo.can_id for pdo in table.pdos if pdo.is_valid} == {0x185, 0x285}


# -- anything a master may try -----------------------------------------------------------------------------------

NAMES = ["bit_0", "bit_1", "int_0", "real_0", "short_0", "single_0", "dummy_5"]


@st.composite
def writes(draw: st.DrawFn) -> tuple[int, int, Any]:
    """A write to one of two PDOs, more often than not a sensible one."""
    number = draw(st.integers(0, 1))
    what = draw(st.sampled_from(["invalid", "valid", "com", "count", "count", "slot", "slot", "slot"]))
    if what in ("invalid", "valid"):
        cob_id = draw(st.sampled_from([0x185, 0x285, 0x333, 0x000, 0x101, 0x2000_0333]))
        return number, 1, (what, cob_id)
    if what == "com":
        subindex = draw(st.sampled_from([2, 3, 5, 6]))
        return number, subindex, ("com", draw(st.integers(0, 255)))
    if what == "count":
        return number, 0, ("count", draw(st.sampled_from([0, 0, 1, 2, 3, 9, 65])))
    return number, draw(st.integers(1, 9)), ("slot", draw(st.sampled_from([*NAMES, 0, 0x5555_00_08])))


@DIRECTIONS
@given(data=st.data())
@settings(max_examples=60)
def test_no_sequence_of_writes_makes_an_inconsistent_pdo_and_a_failed_one_changes_nothing(
    shared_bench: Bench, direction: Direction, data: st.DataObject
) -> None:
    shared_bench.configurations.clear()
    case = Case(shared_bench, direction)
    for number, subindex, (what, value) in data.draw(st.lists(writes(), max_size=40)):
        before, reported = _values(case.table), case.bench.changes
        if what in ("count", "slot"):
            resolved = value if isinstance(value, int) else case.entry(value)
            abort = case.bench.write(case.mapping + number, subindex, resolved)
        elif (case.communication, subindex) in before:
            cob_id = value | (INVALID if what == "invalid" else 0)
            abort = case.bench.write(case.communication + number, subindex, cob_id)
        else:
            continue
        if abort is not None:
            assert _values(case.table) == before
            assert case.bench.changes == reported
        check(case)


def check(case: Case) -> None:
    """Every valid PDO can be sent or received as its entries say, and the listener knows it so."""
    identifiers = []
    for pdo in (one for one in case.table.pdos if one.direction is case.direction):
        configuration = pdo.configuration
        assert pdo.is_valid == (configuration is not None)
        if configuration is None:
            assert case.bench.configurations.get((case.direction, pdo.number)) is None
            continue
        assert case.bench.configurations[case.direction, pdo.number] is configuration
        index = case.mapping + pdo.number - 1
        count = case.bench.read(index, 0)
        bits = [case.bench.read(index, slot) & 0xFF for slot in range(1, count + 1)]
        types = [one.type for one in configuration.mapping]
        assert 0 < sum(bits) <= 64
        assert [one.bits for one in types] == bits
        assert is_aligned(types)
        assert not is_restricted(configuration.can_id)
        assert configuration.transmission <= 240 or configuration.transmission >= 254
        assert configuration.sync_start <= 240
        identifiers.append(configuration.can_id)
    if case.direction is Direction.OUTPUT:
        assert len(set(identifiers)) == len(identifiers)


def test_plan_records_are_what_the_table_takes(bench: Bench) -> None:
    plan = bench.pdo(Direction.OUTPUT, 2, "out_real_0", transmission=10, inhibit=50, event=100, sync_start=3)
    assert isinstance(plan, PdoPlan)
    bench.table(plan)
    configuration = bench.configurations[Direction.OUTPUT, 2]
    assert configuration.can_id == 0x285
    assert (configuration.transmission, configuration.inhibit, configuration.event) == (10, 0.005, 0.1)
    assert configuration.sync_start == 3
