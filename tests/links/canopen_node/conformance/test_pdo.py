"""PDO 01 to 33 of the conformance tester: every transmission type, and every way to map a PDO right and wrong."""

from __future__ import annotations

import struct

import pytest

from tests.links.canopen_node.conformance.bench import NODE, Tester, little

TPDO, RPDO = 0x1800, 0x1400
TPDO_MAP, RPDO_MAP = 0x1A00, 0x1600
INTS_OUT, INTS_IN = 0x2410_0020, 0x2010_0020
REAL_OUT, REAL_IN = 0x2420_0140, 0x2020_0140
INVALID = 0x8000_0000
MAPPINGS = pytest.mark.parametrize("communication", [RPDO, TPDO], ids=["RPDO", "TPDO"])
QUIET = 0.03
"""Seconds in which nothing may come."""


def _entry(base: int, subindex: int) -> int:
    """An element of an array as a mapped object."""
    return base | subindex << 8


def _mappable(communication: int) -> int:
    return INTS_IN if communication == RPDO else INTS_OUT


def _values(number: int) -> bytes:
    """The content of TPDO 2 and RPDO 2 for two integers."""
    return struct.pack("<ii", number, -number)


def _show(dut: Tester, number: int) -> None:
    dut.robot(ints_out__0=number, ints_out__1=-number)


@pytest.mark.parametrize("number", range(4))
def test_cct_pdo_01_rpdo_communication_parameters(dut: Tester, number: int) -> None:
    assert dut.read(RPDO + number, 1) == 0x205 + 0x100 * number
    assert dut.read(RPDO + number, 0) == 5
    assert dut.read(RPDO_MAP + number, 0) == (16, 2, 2, 1)[number]


@pytest.mark.parametrize("number", range(4))
def test_cct_pdo_02_tpdo_communication_parameters(dut: Tester, number: int) -> None:
    assert dut.read(TPDO + number, 1) == 0x4000_0185 + 0x100 * number
    assert dut.read(TPDO + number, 0) == 6
    assert dut.read(TPDO_MAP + number, 0) == (16, 2, 2, 1)[number]


def test_cct_pdo_03_rtr_is_not_allowed_and_not_answered(dut: Tester) -> None:
    """Bit 30 of every TPDO says so, and the tester skips the case."""
    dut.start()
    dut.flush()
    for number in range(4):
        assert dut.read(TPDO + number, 1) & 0x4000_0000
        dut.send(0x185 + 0x100 * number, remote=True, length=8)
    assert [frame for _, frame in dut.frames(QUIET) if frame.can_id & 0x780 != 0x580] == []


def test_cct_pdo_04_event_driven_tpdo(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 254)
    dut.start()
    assert dut.expect(0x285) == _values(0)
    _show(dut, 7)
    assert dut.expect(0x285) == _values(7)
    dut.pre_operational()
    dut.flush()
    _show(dut, 8)
    assert dut.of(0x285, QUIET) == []


def test_cct_pdo_05_event_timer(exact: Tester) -> None:
    exact.transmission(TPDO + 1, 254, event=100)
    exact.start()
    times = [moment for moment, _ in exact.of(0x285, 0.55)]
    assert [round(moment - times[0], 6) for moment in times] == [0, 0.1, 0.2, 0.3, 0.4, 0.5]


def test_cct_pdo_06_inhibit_time_holds_changes_back_and_sends_the_newest(exact: Tester) -> None:
    exact.transmission(TPDO + 1, 254, inhibit=500)
    exact.start()
    first, _ = exact.timed(0x285)
    for number in range(1, 5):
        exact.wait(0.01)
        _show(exact, number)
    ((moment, data),) = exact.of(0x285, 0.2)
    assert (round(moment - first, 6), data) == (0.05, _values(4))


def test_cct_pdo_07_type_0_is_sent_with_the_sync_after_a_change(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 0)
    dut.start()
    dut.flush()
    _show(dut, 5)
    assert dut.of(0x285, QUIET) == []
    dut.sync()
    assert dut.expect(0x285) == _values(5)
    dut.sync()
    assert dut.of(0x285, QUIET) == []


@pytest.mark.parametrize("kind", [1, 2, 3])
def test_cct_pdo_08_first_cyclic_types(dut: Tester, kind: int) -> None:
    _cyclic(dut, kind, 3 * kind)


@pytest.mark.parametrize("kind", [4, 10, 100, 239, 240])
def test_cct_pdo_09_greater_cyclic_types(exact: Tester, kind: int) -> None:
    _cyclic(exact, kind, 2 * kind + 1)


def test_cct_pdo_09_every_cyclic_type_can_be_set(exact: Tester) -> None:
    for communication in (RPDO, TPDO):
        for kind in range(241):
            exact.set(communication, 2, kind, 1)
            assert exact.read(communication, 2) == kind


def _cyclic(dut: Tester, kind: int, syncs: int) -> None:
    """With the first SYNC, and with every n-th after it, whether anything has changed or not."""
    dut.transmission(TPDO + 1, kind)
    dut.start()
    dut.flush()
    for _ in range(syncs):
        dut.sync()
    count = len(dut.of(0x285, 0.05))
    assert count == -(-syncs // kind)


def test_cct_pdo_10_cyclic_tpdo_holds_the_moment_of_its_sync(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 1)
    dut.start()
    dut.flush()
    for number in (3, 4, 4):
        _show(dut, number)
        dut.sync()
        assert dut.expect(0x285) == _values(number)


def test_cct_pdo_11_counting_begins_anew_with_operational(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 3)
    dut.start()
    dut.flush()
    dut.sync()
    dut.expect(0x285)
    dut.pre_operational()
    dut.start()
    dut.flush()
    dut.sync()
    assert dut.expect(0x285) == _values(0)


def test_cct_pdo_12_sync_start_value(dut: Tester) -> None:
    dut.set(0x1019, 0, 10, 1)
    dut.transmission(TPDO + 1, 2, sync_start=3)
    dut.start()
    dut.flush()
    for counter in (1, 2, 3, 4, 5, 6, 7):
        dut.sync(counter)
        if counter in (3, 5, 7):
            dut.expect(0x285)
        assert dut.of(0x285, QUIET) == []


def test_cct_pdo_13_type_255_is_event_driven(dut: Tester) -> None:
    dut.transmission(TPDO + 1, 255)
    dut.start()
    assert dut.expect(0x285) == _values(0)
    _show(dut, 9)
    assert dut.expect(0x285) == _values(9)


@pytest.mark.parametrize("kind", [241, 242, 250, 251, 252, 253])
@MAPPINGS
def test_cct_pdo_14_reserved_types_are_refused(dut: Tester, communication: int, kind: int) -> None:
    """252 and 253 mean an answer to a remote frame, which is not offered."""
    dut.disable(communication)
    assert dut.write(communication, 2, kind, 1) == 0x0609_0030
    assert dut.read(communication, 2) == 254


@pytest.mark.parametrize("kind", [254, 255])
def test_cct_pdo_15_event_driven_rpdo_takes_effect_at_once(dut: Tester, kind: int) -> None:
    dut.transmission(RPDO + 1, kind)
    dut.start()
    dut.send(0x305, _values(21))
    dut.becomes("ints_in[0]", 21)
    assert dut.value("ints_in[1]") == -21


@pytest.mark.parametrize("kind", [0, 1, 2, 240])
def test_cct_pdo_16_synchronous_rpdo_takes_effect_with_sync(dut: Tester, kind: int) -> None:
    dut.transmission(RPDO + 1, kind)
    dut.start()
    dut.send(0x305, _values(20))
    dut.send(0x305, _values(22))
    dut.flush()
    assert dut.value("ints_in[0]") == 0
    dut.sync()
    dut.becomes("ints_in[0]", 22)


def test_cct_pdo_17_pdos_run_in_operational_alone(dut: Tester) -> None:
    for enter in (dut.pre_operational, dut.stop):
        enter()
        dut.send(0x305, _values(23))
        dut.sync()
        _show(dut, 23)
        assert [frame for _, frame in dut.frames(QUIET) if 0x180 <= frame.can_id < 0x580] == []
        assert dut.value("ints_in[0]") == 0


def test_cct_pdo_18_rpdo_deadline(exact: Tester) -> None:
    exact.transmission(RPDO + 1, 255, event=50)
    exact.start()
    exact.wait(1.0)
    assert exact.of(0x085, 0) == [], "the first frame starts the supervision"
    exact.send(0x305, _values(1))
    begin = exact.device.now
    moment, data = exact.timed(0x085)
    assert round(moment - begin, 6) == 0.05
    assert data[:3] == bytes.fromhex("508211")
    exact.send(0x305, _values(1))
    assert exact.expect(0x085)[:2] == b"\0\0"


def test_cct_pdo_19_tpdo_is_silent_while_invalid(dut: Tester) -> None:
    cob_id = dut.disable(TPDO + 1)
    dut.start()
    _show(dut, 1)
    assert dut.of(0x285, QUIET) == []
    dut.set(TPDO + 1, 1, cob_id, 4)
    assert dut.expect(0x285) == _values(1)


def test_cct_pdo_20_rpdo_is_deaf_while_invalid(dut: Tester) -> None:
    cob_id = dut.disable(RPDO + 1)
    dut.start()
    dut.send(0x305, _values(1))
    dut.flush()
    assert dut.value("ints_in[0]") == 0
    dut.set(RPDO + 1, 1, cob_id, 4)
    dut.send(0x305, _values(1))
    dut.becomes("ints_in[0]", 1)


@MAPPINGS
def test_cct_pdo_21_mapping_is_switched_off_and_on(dut: Tester, communication: int) -> None:
    cob_id = dut.disable(communication + 1)
    dut.set(communication + 0x201, 0, 0, 1)
    assert dut.read(communication + 0x201, 0) == 0
    dut.set(communication + 0x201, 0, 2, 1)
    dut.set(communication + 1, 1, cob_id, 4)


def test_cct_pdo_22_pdos_are_mapped_anew(dut: Tester) -> None:
    dut.remap(TPDO, _entry(INTS_OUT, 4), _entry(INTS_OUT, 3))
    dut.remap(RPDO, REAL_IN)
    dut.start()
    dut.robot(ints_out__2=33, ints_out__3=44)
    assert dut.expect(0x185) in (struct.pack("<ii", 0, 0), struct.pack("<ii", 44, 33))
    dut.send(0x205, struct.pack("<d", 1.5))
    dut.becomes("real_in", 1.5)


@MAPPINGS
def test_cct_pdo_23_number_of_objects_while_the_pdo_is_valid(dut: Tester, communication: int) -> None:
    for count in (0, 1, 2):
        code = dut.write(communication + 0x201, 0, count, 1)
        assert code in (0x0601_0000, 0x0604_0041, 0x0800_0000)
    assert dut.read(communication + 0x201, 0) == 2


@MAPPINGS
def test_cct_pdo_24_mapped_object_in_the_wrong_order(dut: Tester, communication: int) -> None:
    """While the PDO is valid, and while the number of objects is not 0."""
    mapping, new = communication + 0x201, _entry(_mappable(communication), 4)
    before = dut.read(mapping, 1)
    assert dut.write(mapping, 1, new, 4) in (0x0601_0000, 0x0604_0041, 0x0800_0000)
    dut.disable(communication + 1)
    assert dut.write(mapping, 1, new, 4) in (0x0601_0000, 0x0604_0041, 0x0800_0000)
    assert dut.read(mapping, 1) == before


@MAPPINGS
def test_cct_pdo_25_more_objects_than_are_set(dut: Tester, communication: int) -> None:
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


@MAPPINGS
def test_cct_pdo_27_cob_id_moves_only_while_invalid(dut: Tester, communication: int) -> None:
    cob_id = dut.read(communication + 1, 1)
    moved = cob_id & ~0x7FF | 0x1A0
    assert dut.write(communication + 1, 1, moved, 4) == 0x0609_0030
    dut.disable(communication + 1)
    dut.set(communication + 1, 1, moved, 4)
    dut.start()
    if communication == TPDO:
        assert dut.expect(0x1A0) == _values(0)
    else:
        dut.send(0x1A0, _values(6))
        dut.becomes("ints_in[0]", 6)


@MAPPINGS
def test_cct_pdo_28_extended_identifiers_are_refused(dut: Tester, communication: int) -> None:
    """Bit 29: an identifier of 29 bits."""
    cob_id = dut.disable(communication)
    assert dut.write(communication, 1, cob_id | 0x2000_0000, 4) == 0x0609_0030
    assert dut.write(communication, 1, 0x0001_2345, 4) == 0x0609_0030


@pytest.mark.parametrize(
    "mapped", [0x1000_0020, 0x1017_0010, 0x5555_0020, 0x2410_6320, 0x2410_0110, INTS_IN | 0x100]
)
def test_cct_pdo_29_what_no_tpdo_may_carry(dut: Tester, mapped: int) -> None:
    """Not mappable, not there, with a wrong length, of the other direction."""
    _unmappable(dut, TPDO + 1, mapped)


@MAPPINGS
def test_cct_pdo_30_only_bits_lie_off_a_byte_boundary(dut: Tester, communication: int) -> None:
    bits = 0x2000_0001 if communication == RPDO else 0x2400_0001
    dut.disable(communication)
    dut.set(communication + 0x200, 0, 0, 1)
    dut.set(communication + 0x200, 1, _entry(bits, 1), 4)
    dut.set(communication + 0x200, 2, _entry(_mappable(communication), 1), 4)
    assert dut.write(communication + 0x200, 0, 2, 1) == 0x0604_0041


def test_cct_pdo_31_dummies_fill_gaps_of_an_rpdo(dut: Tester) -> None:
    dut.remap(RPDO + 1, 0x0005_0008, 0x0006_0010, 0x0002_0008, _entry(INTS_IN, 2))
    dut.start()
    dut.send(0x305, b"\xff\xff\xff\xff" + little(77, 4))
    dut.becomes("ints_in[1]", 77)
    _unmappable(dut, TPDO + 1, 0x0005_0008)


@pytest.mark.parametrize(
    "mapped", [0x1000_0020, 0x1017_0010, 0x5555_0020, 0x2010_6320, 0x2010_0110, INTS_OUT | 0x100]
)
def test_cct_pdo_32_what_no_rpdo_may_carry(dut: Tester, mapped: int) -> None:
    _unmappable(dut, RPDO + 1, mapped)


def _unmappable(dut: Tester, communication: int, mapped: int) -> None:
    dut.disable(communication)
    dut.set(communication + 0x200, 0, 0, 1)
    code = dut.write(communication + 0x200, 1, mapped, 4)
    if not code:
        code = dut.write(communication + 0x200, 0, 1, 1)
    assert code in (0x0602_0000, 0x0604_0041)


@MAPPINGS
def test_cct_pdo_33_reset_brings_the_mapping_back(dut: Tester, communication: int) -> None:
    mapped = [dut.read(communication + 0x201, number) for number in (0, 1, 2)]
    dut.remap(communication + 1, _entry(_mappable(communication), 3))
    dut.transmission(communication + 1, 5)
    assert dut.read(communication + 0x201, 0) == 1
    dut.reset()
    assert [dut.read(communication + 0x201, number) for number in (0, 1, 2)] == mapped
    assert dut.read(communication + 1, 2) == 254
    assert dut.read(communication + 1, 1) & 0x7FF == 0x300 - (communication == TPDO) * 0x80 + NODE
