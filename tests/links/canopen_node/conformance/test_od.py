"""OD 01 to 09 of the conformance tester: every entry of the data sheet against the device."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import canopen
import pytest
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes

from gatewayd.links.canopen_node.eds import eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from tests.links.canopen_node.conformance.bench import NODE, Tester, compiled, little

WRITABLE = ("rw", "wo", "rwr", "rww")
ON_COMMAND = (0x1003, 0x1010, 0x1011, 0x5F00)
"""Writing these is an order, not a value."""
LEFT_OUT = (0x1003, 0x1010, 0x1011)
"""Objects that the tester leaves out where it writes back what it has read."""
SIZES = {"b": 1, "h": 2, "i": 4, "q": 8}


def _entries() -> Iterator[ODVariable]:
    """What the data sheet says, as python-canopen reads it."""
    plan = compiled()
    assert canopen_of(plan) is not None
    text = eds_text(objects_of(plan.the(CanopenPlan), plan.cell), sheet_of(plan.the(CanopenPlan), plan.cell))
    # canopen wants to know where a text comes from.
    file = io.StringIO(text)
    file.name = "dut.eds"
    dictionary: Any = canopen.import_od(file, NODE)
    for one in dictionary.values():
        if isinstance(one, ODVariable):
            yield one
        else:
            assert isinstance(one, ODRecord | ODArray)
            yield from one.subindices.values()


ENTRIES = [entry for entry in _entries() if entry.index >= 0x1000]
NUMBERS = [entry for entry in ENTRIES if entry.data_type in datatypes.INTEGER_TYPES]


def _size(entry: ODVariable) -> int:
    return len(entry) // 8


def _place(entry: ODVariable) -> tuple[int, int]:
    return entry.index, entry.subindex


def _tried() -> list[ODVariable]:
    """The entries of OD 01 and 02: those of PDO parameters have cases of their own."""
    return [entry for entry in ENTRIES if entry.index != 0x1003 and not 0x1400 <= entry.index < 0x1C00]


def _of_the_device() -> list[ODVariable]:
    """The entries of OD 07 to 09: what is not of the communication profile."""
    return [entry for entry in ENTRIES if entry.index >= 0x2000]


def _accessed(exact: Tester, entries: list[ODVariable]) -> int:
    """Read each entry and write its value back where the data sheet allows it; how many were written."""
    count = 0
    for entry in entries:
        data = exact.upload(*_place(entry))
        assert isinstance(data, bytes), f"{entry.index:04X}h {entry.name} aborts with {data:08X}h"
        if entry.access_type in WRITABLE and entry.index not in LEFT_OUT:
            code = exact.download(*_place(entry), data)
            assert code == 0, f"{entry.index:04X}h {entry.name} aborts with {code:08X}h"
            count += 1
    return count


def _has_default(exact: Tester, entries: list[ODVariable]) -> int:
    """Compare each entry with the default value of the data sheet; how many have one."""
    count = 0
    for entry in entries:
        if entry.default is not None:
            data = exact.upload(*_place(entry))
            assert isinstance(data, bytes), f"{entry.index:04X}h {entry.name} aborts with {data:08X}h"
            assert entry.decode_raw(data) == entry.default, f"{entry.index:04X}h {entry.name}"
            count += 1
    return count


def test_cct_eds_checker_the_file_is_read_by_python_canopen() -> None:
    assert len(ENTRIES) > 700


def test_cct_od_01_every_entry_is_accessed_as_its_type_says(exact: Tester) -> None:
    assert _accessed(exact, _tried()) > 40


def test_cct_od_02_every_entry_has_its_default(exact: Tester) -> None:
    """What shows the present state of the cell has none."""
    assert _has_default(exact, _tried()) > 50


def test_cct_od_05_there_is_no_sub_index_255(dut: Tester) -> None:
    assert {dut.upload(index, 255) for index in {entry.index for entry in ENTRIES}} == {0x0609_0011}


def test_cct_od_07_every_entry_of_the_device_is_accessed(exact: Tester) -> None:
    assert _accessed(exact, _of_the_device()) > 20


def test_cct_od_08_every_entry_of_the_device_has_its_default(exact: Tester) -> None:
    assert _has_default(exact, _of_the_device()) > 5


def test_cct_od_09_every_writable_entry_of_the_device_takes_its_own_value_back(exact: Tester) -> None:
    entries = [entry for entry in _of_the_device() if entry.access_type in WRITABLE]
    assert _accessed(exact, entries) == len(entries)


def test_301_every_entry_of_the_data_sheet_exists(dut: Tester) -> None:
    assert len(ENTRIES) > 700
    missing = {_place(entry) for entry in ENTRIES if dut.upload(*_place(entry)) in (0x0602_0000, 0x0609_0011)}
    assert missing == set()


def test_301_every_entry_has_the_length_of_its_type(exact: Tester) -> None:
    for entry in ENTRIES:
        data = exact.upload(*_place(entry))
        if entry.index == 0x1003 and entry.subindex:
            assert data == 0x0800_0024, "no such error yet"
        elif entry.data_type != datatypes.VISIBLE_STRING:
            assert isinstance(data, bytes)
            assert len(data) == _size(entry) or (entry.data_type == datatypes.BOOLEAN and len(data) == 1)


def test_cct_od_03_what_is_read_only_cannot_be_written(exact: Tester) -> None:
    for entry in NUMBERS:
        if entry.access_type not in WRITABLE:
            assert exact.write(*_place(entry), 0, _size(entry)) == 0x0601_0002
    assert exact.download(0x1008, 0, b"another name") == 0x0601_0002


def test_cct_od_04_nothing_is_written_only(exact: Tester) -> None:
    """There is nothing of the kind; what may be read can be."""
    assert [entry.name for entry in ENTRIES if entry.access_type == "wo"] == []
    for entry in ENTRIES:
        assert exact.upload(*_place(entry)) != 0x0601_0001


def test_301_every_entry_takes_its_own_value_back_pdo_parameters_too(exact: Tester) -> None:
    """But for those of valid PDOs, which their order of change protects."""
    for number in range(4):
        exact.disable(0x1400 + number)
        exact.disable(0x1800 + number)
    for entry in ENTRIES:
        if entry.access_type in WRITABLE and entry.index not in ON_COMMAND:
            data = exact.upload(*_place(entry))
            assert isinstance(data, bytes)
            code = exact.download(*_place(entry), data)
            mapped = entry.index & 0xFC00 in (0x1400, 0x1800) and entry.index & 0x0200
            assert code == 0 or (mapped and code == 0x0601_0000), (
                f"{entry.index:04X}h {entry.name}: {code:08X}h"
            )
            assert exact.upload(*_place(entry)) == data


def test_cct_od_06_low_limits_are_the_last_values_that_are_taken(exact: Tester) -> None:
    assert _limits(exact, "min", -1) >= 2


def test_cct_od_06_high_limits_are_the_last_values_that_are_taken(exact: Tester) -> None:
    assert _limits(exact, "max", 1) >= 2


def _limits(exact: Tester, which: str, beyond: int) -> int:
    count = 0
    for entry in NUMBERS:
        limit = getattr(entry, which)
        if limit is None or entry.access_type not in WRITABLE:
            continue
        count += 1
        exact.set(*_place(entry), limit, _size(entry))
        assert exact.write(*_place(entry), limit + beyond, _size(entry)) in (
            0x0609_0030,
            0x0609_0031,
            0x0609_0032,
        )
        exact.set(*_place(entry), 0, _size(entry))
    return count


def test_301_what_the_sheet_does_not_name_is_not_there(exact: Tester) -> None:
    named = {entry.index for entry in ENTRIES}
    for index in (*range(0x1000, 0x2200), *range(0x2400, 0x2500), *range(0x5E00, 0x6100)):
        if index not in named:
            assert exact.upload(index) == 0x0602_0000, f"{index:04X}h"


@pytest.mark.parametrize("index", sorted({entry.index for entry in ENTRIES if entry.subindex == 1}))
def test_301_sub_index_0_counts_the_others(exact: Tester, index: int) -> None:
    subindices = [entry.subindex for entry in ENTRIES if entry.index == index]
    if index & 0xFE00 not in (0x1600, 0x1A00):
        assert exact.read(index) == (0 if index == 0x1003 else max(subindices))
    assert exact.sdo(b"\x40" + little(index, 2) + bytes([max(subindices) + 1]))[4:] == little(0x0609_0011, 4)
