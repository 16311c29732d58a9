"""PDO 21 to 33 of the conformance tester: every way to map a PDO, right and wrong; and what CiA 301 says beyond."""

from __future__ import annotations

import struct

import pytest

from tests.links.canopen_node.conformance.bench import NODE, Tester, little

TPDO, RPDO = 0x1800, 0x1400
BITS_OUT, BITS_IN = 0x2400_0001, 0x2000_0001
INTS_OUT, INTS_IN = 0x2410_0020, 0x2010_0020
REAL_OUT, REAL_IN = 0x2420_0140, 0x2020_0140
INVALID = 0x8000_0000
UNMAPPABLE = (0x1000_0020, 0x1015_0010, 0x1017_0010, 0x1400_0510, 0x1401_0510)
MAPPINGS = pytest.mark.parametrize("communication", [RPDO, TPDO], ids=["RPDO", "TPDO"])


def _entry(base: int, subindex: int) -> int:
    """An element of an array as a mapped object."""
    return base | subindex << 8


def _mappable(communication: int) -> int:
    return INTS_IN if communication == RPDO else INTS_OUT


@MAPPINGS
def test_301_mapping_is_switched_off_and_on(dut: Tester, communication: int) -> None:
    cob_id = dut.disable(communication + 1)
    dut.set(communication + 0x201, 0, 0, 1)
    assert dut.read(communication + 0x201, 0) == 0
    dut.set(communication + 0x201, 0, 2, 1)
    dut.set(communication + 1, 1, cob_id, 4)


@MAPPINGS
def test_cct_pdo_21_mapped_objects_are_there(dut: Tester, communication: int) -> None:
    """Each with the length that it is mapped with."""
    count = 0
    for mapping in range(communication + 0x200, communication + 0x204):
        for number in range(1, dut.read(mapping, 0) + 1):
            mapped = dut.read(mapping, number)
            data = dut.upload(mapped >> 16, mapped >> 8 & 0xFF)
            assert isinstance(data, bytes)
            assert mapped & 0xFF in (1, 8 * len(data))
            count += 1
    assert count == 21


@MAPPINGS
def test_cct_pdo_22_the_same_mapping_in_the_order_of_the_tester(dut: Tester, communication: int) -> None:
    """Every frame of the case is confirmed, here as in the trace, which calls it failed nevertheless."""
    mapping = communication + 0x201
    mapped = dut.read(mapping, 1)
    cob_id = dut.read(communication + 1, 1)
    dut.set(communication + 1, 1, cob_id | INVALID, 4)
    count = dut.read(mapping, 0)
    dut.set(mapping, 0, 0, 1)
    dut.set(mapping, 1, mapped, 4)
    dut.set(mapping, 0, count, 1)
    assert dut.read(communication + 1, 1) == cob_id | INVALID
    dut.set(communication + 1, 1, cob_id, 4)
    assert (dut.read(mapping, 0), dut.read(mapping, 1), dut.read(communication + 1, 1)) == (2, mapped, cob_id)


def test_cct_pdo_22_pdos_are_mapped_anew(dut: Tester) -> None:
    dut.remap(TPDO, _entry(INTS_OUT, 4), _entry(INTS_OUT, 3))
    dut.remap(RPDO, REAL_IN)
    dut.start()
    dut.robot(ints_out__2=33, ints_out__3=44)
    assert dut.expect(0x185) in (struct.pack("<ii", 0, 0), struct.pack("<ii", 44, 33))
    dut.send(0x205, struct.pack("<d", 1.5))
    dut.becomes("real_in", 1.5)


@MAPPINGS
def test_cct_pdo_24_number_of_objects_while_the_pdo_is_valid(dut: Tester, communication: int) -> None:
    for count in (0, 1, 2):
        code = dut.write(communication + 0x201, 0, count, 1)
        assert code in (0x0601_0000, 0x0604_0041, 0x0800_0000)
    assert dut.read(communication + 0x201, 0) == 2


@MAPPINGS
def test_cct_pdo_24_mapped_object_while_the_pdo_is_valid(dut: Tester, communication: int) -> None:
    _mapped_object_is_refused(dut, communication)


@MAPPINGS
def test_cct_pdo_23_mapped_object_while_the_number_is_not_0(dut: Tester, communication: int) -> None:
    dut.disable(communication + 1)
    _mapped_object_is_refused(dut, communication)


def _mapped_object_is_refused(dut: Tester, communication: int) -> None:
    mapping, new = communication + 0x201, _entry(_mappable(communication), 4)
    before = dut.read(mapping, 1)
    for mapped in (before, new):
        assert dut.write(mapping, 1, mapped, 4) in (0x0601_0000, 0x0604_0041, 0x0800_0000)
    assert dut.read(mapping, 1) == before


@MAPPINGS
def test_cct_pdo_25_one_object_more_than_there_are_entries(exact: Tester, communication: int) -> None:
    """A bit in all 64 entries, and 65 of them."""
    mapping = communication + 0x201
    exact.disable(communication + 1)
    exact.set(mapping, 0, 0, 1)
    for number in range(1, 65):
        exact.set(mapping, number, _entry(BITS_IN if communication == RPDO else BITS_OUT, 1), 4)
    assert exact.write(mapping, 0, 65, 1) in (0x0602_0000, 0x0604_0041, 0x0604_0042)


@MAPPINGS
def test_301_more_objects_than_are_set(dut: Tester, communication: int) -> None:
    mapping = communication + 0x201
    dut.disable(communication + 1)
    dut.set(mapping, 0, 0, 1)
    for count in (3, 64, 65, 255):
        assert dut.write(mapping, 0, count, 1) in (0x0601_0000, 0x0604_0041, 0x0604_0042)


@MAPPINGS
def test_cct_pdo_26_objects_of_more_than_64_bits(dut: Tester, communication: int) -> None:
    """One of 32 bits in all of the first eight entries, as the tester does it."""
    mapping = communication + 0x201
    dut.disable(communication + 1)
    dut.set(mapping, 0, 0, 1)
    for number in range(1, 9):
        dut.set(mapping, number, _entry(_mappable(communication), 1), 4)
    assert dut.write(mapping, 0, 8, 1) in (0x0602_0000, 0x0604_0041, 0x0604_0042)
    dut.set(mapping, 0, 2, 1)


@pytest.mark.parametrize(
    "mapped", [0x1000_0020, 0x1017_0010, 0x5555_0020, 0x2410_6320, 0x2410_0110, INTS_IN | 0x100]
)
def test_301_what_no_tpdo_may_carry(dut: Tester, mapped: int) -> None:
    """Not mappable, not there, with a wrong length, of the other direction."""
    _unmappable(dut, TPDO + 1, mapped)


@MAPPINGS
def test_301_only_bits_lie_off_a_byte_boundary(dut: Tester, communication: int) -> None:
    bits = BITS_IN if communication == RPDO else BITS_OUT
    dut.disable(communication)
    dut.set(communication + 0x200, 0, 0, 1)
    dut.set(communication + 0x200, 1, _entry(bits, 1), 4)
    dut.set(communication + 0x200, 2, _entry(_mappable(communication), 1), 4)
    assert dut.write(communication + 0x200, 0, 2, 1) == 0x0604_0041


def test_cct_pdo_27_an_input_into_an_rpdo(dut: Tester) -> None:
    assert _mapped(dut, RPDO + 1, _entry(INTS_IN, 1)) == 0


@pytest.mark.parametrize("mapped", [INTS_OUT | 0x100, BITS_OUT | 0x100, REAL_OUT])
def test_cct_pdo_28_no_output_into_an_rpdo(dut: Tester, mapped: int) -> None:
    assert _mapped(dut, RPDO + 1, mapped) in (0x0602_0000, 0x0604_0041)


@pytest.mark.parametrize("mapped", UNMAPPABLE)
def test_cct_pdo_29_nothing_unmappable_into_an_rpdo(dut: Tester, mapped: int) -> None:
    assert _mapped(dut, RPDO + 1, mapped) in (0x0602_0000, 0x0604_0041)


@pytest.mark.parametrize("mapped", [INTS_OUT | 0x100, BITS_OUT | 0x100, REAL_OUT])
def test_cct_pdo_30_an_output_into_a_tpdo(dut: Tester, mapped: int) -> None:
    assert _mapped(dut, TPDO + 1, mapped) == 0
    dut.set(TPDO + 0x201, 0, 1, 1)


@pytest.mark.parametrize("mapped", [INTS_IN | 0x100, BITS_IN | 0x100, REAL_IN])
def test_cct_pdo_31_no_input_into_a_tpdo(dut: Tester, mapped: int) -> None:
    assert _mapped(dut, TPDO + 1, mapped) in (0x0602_0000, 0x0604_0041)


@pytest.mark.parametrize("mapped", UNMAPPABLE)
def test_cct_pdo_32_nothing_unmappable_into_a_tpdo(dut: Tester, mapped: int) -> None:
    assert _mapped(dut, TPDO + 1, mapped) in (0x0602_0000, 0x0604_0041)


def _mapped(dut: Tester, communication: int, mapped: int) -> int:
    """The answer when an object is made the first of a PDO that is switched off; 0, or the abort code."""
    dut.disable(communication)
    dut.set(communication + 0x200, 0, 0, 1)
    return dut.write(communication + 0x200, 1, mapped, 4)


@pytest.mark.parametrize("number", range(4))
def test_cct_pdo_33_a_dummy_into_every_rpdo(dut: Tester, number: int) -> None:
    assert _mapped(dut, RPDO + number, 0x0002_0008) == 0


def test_cct_pdo_33_dummies_fill_gaps_of_an_rpdo(dut: Tester) -> None:
    dut.remap(RPDO + 1, 0x0005_0008, 0x0006_0010, 0x0002_0008, _entry(INTS_IN, 2))
    dut.start()
    dut.send(0x305, b"\xff\xff\xff\xff" + little(77, 4))
    dut.becomes("ints_in[1]", 77)
    _unmappable(dut, TPDO + 1, 0x0005_0008)


@pytest.mark.parametrize(
    "mapped", [0x1000_0020, 0x1017_0010, 0x5555_0020, 0x2010_6320, 0x2010_0110, INTS_OUT | 0x100]
)
def test_301_what_no_rpdo_may_carry(dut: Tester, mapped: int) -> None:
    _unmappable(dut, RPDO + 1, mapped)


def _unmappable(dut: Tester, communication: int, mapped: int) -> None:
    dut.disable(communication)
    dut.set(communication + 0x200, 0, 0, 1)
    code = dut.write(communication + 0x200, 1, mapped, 4)
    if not code:
        code = dut.write(communication + 0x200, 0, 1, 1)
    assert code in (0x0602_0000, 0x0604_0041)


@MAPPINGS
def test_301_reset_brings_the_mapping_back(dut: Tester, communication: int) -> None:
    mapped = [dut.read(communication + 0x201, number) for number in (0, 1, 2)]
    dut.remap(communication + 1, _entry(_mappable(communication), 3))
    dut.transmission(communication + 1, 5)
    assert dut.read(communication + 0x201, 0) == 1
    dut.reset()
    assert [dut.read(communication + 0x201, number) for number in (0, 1, 2)] == mapped
    assert dut.read(communication + 1, 2) == 254
    assert dut.read(communication + 1, 1) & 0x7FF == 0x300 - (communication == TPDO) * 0x80 + NODE
