"""SDO 01 to 30 of the conformance tester, with the abort codes that it accepts."""

from __future__ import annotations

from binascii import crc_hqx

import pytest

from tests.links.canopen_node.conformance.bench import NODE, Tester, little

BLOCK_SIZE = 20
NAME = b"gatewayd dut"
GUARD_TIME, HEARTBEAT = 0x100C, 0x1017


def test_cct_sdo_01_device_type_expedited(dut: Tester) -> None:
    assert dut.sdo(bytes.fromhex("40001000")) == bytes.fromhex("4300100000000000")


def test_cct_sdo_02_read_and_write_of_communication_objects(dut: Tester) -> None:
    for index, size in ((HEARTBEAT, 2), (0x1006, 4), (0x1007, 4), (0x1015, 2)):
        value = dut.read(index)
        dut.set(index, 0, value, size)
        assert dut.read(index) == value


def test_cct_sdo_03_writing_the_device_type(dut: Tester) -> None:
    assert dut.write(0x1000, 0, 0x000F_0191, 4) in (0x0601_0000, 0x0601_0002, 0x0800_0000)
    assert dut.read(0x1000) == 0


def test_cct_sdo_04_no_object_is_write_only(dut: Tester) -> None:
    """The tester skips the case for want of such an object."""
    access = dut.device.do(
        lambda node, _cell, _now: {entry.access.readable for one in node.dictionary for entry in one.entries}
    )
    assert access == {True}


@pytest.mark.parametrize(
    "index, subindex", [(0x1000, 1), (0x1018, 5), (0x1400, 4), (0x2000, 17), (0x2410, 255)]
)
def test_cct_sdo_05_subindex_that_does_not_exist(dut: Tester, index: int, subindex: int) -> None:
    assert dut.upload(index, subindex) in (0x0609_0011, 0x0800_0000)
    assert dut.write(index, subindex, 0, 4) in (0x0609_0011, 0x0800_0000)


@pytest.mark.parametrize("index", [0x0000, 0x0001, 0x1004, 0x1201, 0x2001, 0x6000, 0xFFFF])
def test_cct_sdo_06_object_that_does_not_exist(dut: Tester, index: int) -> None:
    assert dut.upload(index) in (0x0602_0000, 0x0800_0000)
    assert dut.write(index, 0, 0, 1) in (0x0602_0000, 0x0800_0000)


def test_cct_sdo_07_wrong_command_specifier(dut: Tester) -> None:
    answer = dut.sdo(bytes.fromhex("e0001000"))
    assert answer[0] == 0x80
    assert int.from_bytes(answer[4:], "little") in (0x0504_0001, 0x0800_0000)
    assert dut.read(0x1000) == 0


def test_cct_sdo_08_more_bytes_than_the_object_has(dut: Tester) -> None:
    for index, subindex in ((0x1003, 0), (HEARTBEAT, 0), (0x2060, 1)):
        assert dut.write(index, subindex, 0, 4) in (0x0607_0010, 0x0607_0012, 0x0800_0000)


def test_cct_sdo_09_fewer_bytes_than_the_object_has(dut: Tester) -> None:
    for index, subindex in ((0x1005, 0), (HEARTBEAT, 0), (0x2010, 1)):
        assert dut.write(index, subindex, 0x80 if index == 0x1005 else 0, 1) in (
            0x0607_0010,
            0x0607_0013,
            0x0800_0000,
        )


@pytest.mark.parametrize(
    "index, subindex, value, size",
    [(0x1003, 0, 0xFF, 1), (0x2010, 5, 101, 4), (0x2060, 1, 501, 2), (0x2000, 1, 2, 1)],
)
def test_cct_sdo_10_value_too_high(dut: Tester, index: int, subindex: int, value: int, size: int) -> None:
    assert dut.write(index, subindex, value, size) in (0x0609_0030, 0x0609_0031, 0x0800_0000)


@pytest.mark.parametrize(
    "index, subindex, value, size", [(0x2010, 5, -101, 4), (0x2060, 1, -501, 2), (0x1006, 0, 1, 4)]
)
def test_cct_sdo_11_value_too_low(dut: Tester, index: int, subindex: int, value: int, size: int) -> None:
    assert dut.write(index, subindex, value, size) in (0x0609_0030, 0x0609_0032, 0x0800_0000)


def test_cct_sdo_12_server_parameters_are_the_predefined_ones(dut: Tester) -> None:
    assert dut.read(0x1200, 1) == 0x600 + NODE
    assert dut.read(0x1200, 2) == 0x580 + NODE
    assert dut.write(0x1200, 1, 0x600 + NODE, 4) == 0x0601_0002


def test_cct_sdo_13_short_object_may_be_read_segmented(dut: Tester) -> None:
    """What has four bytes is answered expedited, which the tester takes."""
    assert dut.upload(0x1000) == bytes(4)


def test_cct_sdo_14_guard_time_written_segmented(dut: Tester) -> None:
    _write_segmented(dut, GUARD_TIME)


def test_cct_sdo_15_heartbeat_time_written_segmented(dut: Tester) -> None:
    _write_segmented(dut, HEARTBEAT)


def _write_segmented(dut: Tester, index: int) -> None:
    head = little(index, 2) + b"\0"
    assert dut.sdo(b"\x21" + head + little(2, 4)) == b"\x60" + head + bytes(4)
    assert dut.sdo(b"\x0b" + little(0x1234, 2)) == b"\x20" + bytes(7)
    assert dut.read(index) == 0x1234


def test_cct_sdo_16_long_object_read_segmented(dut: Tester) -> None:
    assert dut.sdo(bytes.fromhex("40081000")) == bytes.fromhex("410810000C000000")
    assert dut.sdo(b"\x60") == b"\x00" + NAME[:7]
    assert dut.sdo(b"\x70") == b"\x15" + NAME[7:].ljust(7, b"\0")


def test_cct_sdo_17_wrong_toggle_bit(dut: Tester) -> None:
    dut.sdo(bytes.fromhex("40081000"))
    assert dut.sdo(b"\x70") == bytes.fromhex("8008100000000305")
    assert dut.upload(0x1008) == NAME


@pytest.mark.parametrize("index, subindex", [(0x1008, 0), (0x1009, 0), (0x100A, 0), (0x2420, 1)])
def test_cct_sdo_18_every_long_object_read_segmented(dut: Tester, index: int, subindex: int) -> None:
    data = dut.upload(index, subindex)
    assert isinstance(data, bytes)
    assert len(data) > 4 or index == 0x1009


def test_cct_sdo_19_device_type_as_a_block_without_crc(dut: Tester) -> None:
    assert _upload_block(dut, 0x1000, crc=False) == bytes(4)


def test_cct_sdo_20_guard_time_as_a_block_without_crc(dut: Tester) -> None:
    _download_block(dut, GUARD_TIME, crc=False)


def test_cct_sdo_21_heartbeat_time_as_a_block_without_crc(dut: Tester) -> None:
    _download_block(dut, HEARTBEAT, crc=False)


def test_cct_sdo_22_long_object_as_a_block(dut: Tester) -> None:
    assert _upload_block(dut, 0x1008, crc=False) == NAME


def test_cct_sdo_23_long_object_as_a_block_with_crc(dut: Tester) -> None:
    assert _upload_block(dut, 0x1008, crc=True) == NAME


def test_cct_sdo_24_guard_time_as_a_block_with_crc(dut: Tester) -> None:
    _download_block(dut, GUARD_TIME, crc=True)


def test_cct_sdo_25_heartbeat_time_as_a_block_with_crc(dut: Tester) -> None:
    _download_block(dut, HEARTBEAT, crc=True)


def test_cct_sdo_26_block_size_128(dut: Tester) -> None:
    answer = dut.sdo(bytes.fromhex("a000100080"))
    assert (answer[0], int.from_bytes(answer[4:], "little")) == (0x80, 0x0504_0002)


def test_cct_sdo_27_wrong_sequence_number(dut: Tester) -> None:
    dut.sdo(bytes([0xA0, 0x00, 0x10, 0x00, BLOCK_SIZE]))
    dut.sdo(b"\xa3")
    answer = dut.sdo(bytes([0xA2, 128, BLOCK_SIZE]))
    assert answer[:4] == bytes.fromhex("80001000")
    assert int.from_bytes(answer[4:], "little") in (0x0504_0003, 0x0504_0001, 0x0800_0000)
    assert dut.read(0x1000) == 0


def test_cct_sdo_28_there_is_one_server(dut: Tester) -> None:
    assert {dut.upload(index, 1) for index in range(0x1201, 0x1280)} == {0x0602_0000}


def test_cct_sdo_29_there_is_one_server_after_a_reset_of_communication(dut: Tester) -> None:
    dut.reset(130)
    assert {dut.upload(index, 1) for index in range(0x1201, 0x1280)} == {0x0602_0000}


def test_cct_sdo_30_there_is_no_client(dut: Tester) -> None:
    assert {dut.upload(index, 1) for index in range(0x1280, 0x1300)} == {0x0602_0000}


def _upload_block(dut: Tester, index: int, *, crc: bool) -> bytes:
    answer = dut.sdo(bytes([0xA4 if crc else 0xA0]) + little(index, 2) + bytes([0, BLOCK_SIZE, 0]))
    assert answer[0] & ~0x04 == 0xC2, "a block upload with its size"
    size = int.from_bytes(answer[4:], "little")
    data, number, last = b"", 0, 0
    dut.send(0x600 + NODE, b"\xa3".ljust(8, b"\0"))
    while not last:
        segment = dut.expect(0x580 + NODE)
        number, last = number + 1, segment[0] & 0x80
        assert segment[0] & 0x7F == number
        data += segment[1:]
    end = dut.sdo(bytes([0xA2, number, BLOCK_SIZE]))
    unused = end[0] >> 2 & 7
    assert end[0] == 0xC1 | unused << 2
    data = data[: len(data) - unused]
    assert len(data) == size
    if crc:
        assert int.from_bytes(end[1:3], "little") == crc_hqx(data, 0)
    dut.send(0x600 + NODE, b"\xa1".ljust(8, b"\0"))
    return data


def _download_block(dut: Tester, index: int, *, crc: bool) -> None:
    data, head = b"\x34\x12", little(index, 2) + b"\0"
    answer = dut.sdo(bytes([0xC6 if crc else 0xC2]) + head + little(2, 4))
    assert answer[0] & ~0x04 == 0xA0
    assert answer[1:4] == head
    assert 1 <= answer[4] <= 127
    assert dut.sdo(b"\x81" + data)[:2] == b"\xa2\x01"
    check = crc_hqx(data, 0) if crc else 0
    assert dut.sdo(b"\xd5" + little(check, 2)) == b"\xa1" + bytes(7)
    assert dut.read(index) == 0x1234
