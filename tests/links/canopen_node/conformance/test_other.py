"""Testing other 01 to 10 of the conformance tester: stored parameters, restricted COB-IDs; and meaningless frames."""

from __future__ import annotations

import pytest

from gatewayd.canopen.cob_ids import is_restricted
from tests.links.canopen_node.conformance.bench import NODE, Tester

SAVE, LOAD, WRONG = (int.from_bytes(word, "little") for word in (b"save", b"load", b"norw"))
STORE, RESTORE = 0x1010, 0x1011
RESTRICTED = (
    (0x000, 0x07F),
    (0x101, 0x180),
    (0x581, 0x5FF),
    (0x601, 0x67F),
    (0x6E0, 0x6FF),
    (0x701, 0x77F),
    (0x780, 0x7FF),
)
QUIET = 0.03


def _power_cycle(dut: Tester) -> None:
    dut.device.power_off()
    dut.device.power_on()
    dut.reaches(0)


CHANGES = ((0x1005, 4, 0x200), (0x1006, 4, 5_000), (0x1015, 2, 1_000), (0x1017, 2, 20_000))
"""What the tester writes before it saves or restores: objects, their size, and a value that is not the default."""
DEFAULTS = [0x80, 0, 0, 0]


def _changed(dut: Tester) -> None:
    for index, size, value in CHANGES:
        dut.set(index, 0, value, size)


def _values(dut: Tester) -> list[int]:
    return [dut.read(index) for index, _, _ in CHANGES]


def _refuses_wrong_signature(dut: Tester, index: int, subindex: int) -> None:
    assert dut.read(index, subindex) & 1
    _changed(dut)
    assert dut.write(index, subindex, WRONG, 4) == 0x0800_0020
    assert _values(dut) == [value for _, _, value in CHANGES]


def _saves(dut: Tester, subindex: int) -> None:
    assert dut.read(STORE, subindex) & 1
    _changed(dut)
    dut.set(STORE, subindex, SAVE, 4)
    dut.reset()
    assert _values(dut) == [value for _, _, value in CHANGES]


def _restores(dut: Tester, subindex: int) -> None:
    """After a save, as the cases follow each other."""
    _saves(dut, subindex)
    _changed(dut)
    dut.set(RESTORE, subindex, LOAD, 4)
    dut.reset()
    assert _values(dut) == DEFAULTS


def test_cct_testing_other_01_wrong_signature_to_save_all(dut: Tester) -> None:
    _refuses_wrong_signature(dut, STORE, 1)


def test_cct_testing_other_02_save_all(dut: Tester) -> None:
    _saves(dut, 1)


def test_cct_testing_other_03_wrong_signature_to_restore_all(dut: Tester) -> None:
    _refuses_wrong_signature(dut, RESTORE, 1)


def test_cct_testing_other_04_restore_all(dut: Tester) -> None:
    _restores(dut, 1)


def test_cct_testing_other_05_wrong_signature_to_save_communication(dut: Tester) -> None:
    _refuses_wrong_signature(dut, STORE, 2)


def test_cct_testing_other_06_save_communication(dut: Tester) -> None:
    _saves(dut, 2)


def test_cct_testing_other_07_wrong_signature_to_restore_communication(dut: Tester) -> None:
    _refuses_wrong_signature(dut, RESTORE, 2)


def test_cct_testing_other_08_restore_communication(dut: Tester) -> None:
    _restores(dut, 2)


def test_cct_testing_other_09_there_is_no_object_for_the_time_of_configuration(dut: Tester) -> None:
    """1020h. The tester skips the case."""
    assert dut.upload(0x1020, 1) == 0x0602_0000


def test_301_what_can_be_stored(dut: Tester) -> None:
    """On command, not by itself."""
    for index in (STORE, RESTORE):
        assert dut.read(index) == 4
        assert [dut.read(index, number) for number in range(1, 5)] == [1] * 4


@pytest.mark.parametrize("index", [STORE, RESTORE])
def test_301_wrong_signatures(dut: Tester, index: int) -> None:
    wrong = LOAD if index == STORE else SAVE
    for signature in (wrong, 0, 0x6576_6153, 0xFFFF_FFFF):
        for subindex in range(1, 5):
            assert dut.write(index, subindex, signature, 4) == 0x0800_0020


def test_301_saved_parameters_survive_power_off(dut: Tester) -> None:
    dut.set(0x1017, 0, 1234, 2)
    _power_cycle(dut)
    assert dut.read(0x1017) == 0
    dut.set(0x1017, 0, 1234, 2)
    dut.set(STORE, 1, SAVE, 4)
    _power_cycle(dut)
    assert dut.read(0x1017) == 1234
    dut.reset(130)
    assert dut.read(0x1017) == 1234


def test_301_defaults_come_back_with_the_reset(dut: Tester) -> None:
    dut.set(0x1017, 0, 1234, 2)
    dut.set(STORE, 1, SAVE, 4)
    dut.set(RESTORE, 1, LOAD, 4)
    assert dut.read(0x1017) == 1234
    dut.reset()
    assert dut.read(0x1017) == 0
    _power_cycle(dut)
    assert dut.read(0x1017) == 0


def test_301_pdos_are_saved_as_they_are(dut: Tester) -> None:
    dut.remap(0x1801, 0x2410_0320)
    dut.transmission(0x1801, 1)
    dut.set(STORE, 2, SAVE, 4)
    _power_cycle(dut)
    assert (dut.read(0x1A01), dut.read(0x1A01, 1), dut.read(0x1801, 2)) == (1, 0x2410_0320, 1)
    dut.start()
    dut.sync()
    assert dut.expect(0x285) == bytes(4)


def test_301_nothing_is_stored_while_operational(dut: Tester) -> None:
    dut.start()
    assert dut.write(STORE, 1, SAVE, 4) == 0x0800_0022
    assert dut.write(RESTORE, 1, LOAD, 4) == 0x0800_0022


@pytest.mark.parametrize("length", [0, 1, 4, 7])
def test_301_sdo_frames_of_another_length(dut: Tester, length: int) -> None:
    dut.send(0x600 + NODE, bytes.fromhex("4000100000000000")[:length])
    assert dut.frames(QUIET) == []
    assert dut.read(0x1000) == 0


def test_301_remote_frames_and_foreign_nodes(dut: Tester) -> None:
    for can_id in (0x000, 0x600 + NODE, 0x580 + NODE, 0x205, 0x080, 0x7E5):
        dut.send(can_id, remote=True, length=8)
    dut.send(0x600 + NODE + 1, bytes.fromhex("4000100000000000"))
    dut.send(0x700 + NODE + 1, remote=True, length=1)
    assert dut.frames(QUIET) == []


def test_301_nmt_frames_that_are_none(dut: Tester) -> None:
    """Wrong lengths, unknown commands."""
    for data in (b"", b"\1", bytes([1, NODE, 0]), bytes([3, NODE]), bytes([80, NODE]), bytes([255, NODE])):
        dut.send(0x000, data)
    dut.heartbeats(5)
    dut.stays(127)


@pytest.mark.parametrize("index, subindex", [(0x1005, 0), (0x1012, 0), (0x1014, 0), (0x1400, 1), (0x1800, 1)])
def test_cct_testing_other_10_restricted_cob_ids(exact: Tester, index: int, subindex: int) -> None:
    """Each of them into every object that holds a COB-ID, while the object is valid, invalid, and to make it valid."""
    low_high = [cob_id for low, high in RESTRICTED for cob_id in range(low, high + 1)]
    assert [cob_id for cob_id in range(0x800) if is_restricted(cob_id)] == low_high
    for cob_id in low_high:
        assert exact.write(index, subindex, cob_id, 4) == 0x0609_0030, f"{cob_id:03X}h"
    if subindex:
        exact.disable(index)
        for cob_id in low_high:
            assert exact.write(index, subindex, cob_id, 4) == 0x0609_0030, f"{cob_id:03X}h"
