from __future__ import annotations

import pytest

from gatewayd.modbus.frames import (
    BUFFER_SIZE,
    MAX_FRAME,
    FrameBuffer,
    FramingError,
    ModbusFrame,
    encode,
    split,
)

READ = bytes.fromhex("1501 0000 0006 ff 03 0004 0001")


def test_encodes_the_example_of_the_messaging_guide() -> None:
    assert encode(0x1501, 0xFF, bytes.fromhex("03 02 0005")) == bytes.fromhex("1501 0000 0005 ff 03 02 0005")


def test_splits_a_frame_off() -> None:
    assert split(bytearray(READ + READ), 0, 24) == ModbusFrame(0x1501, 0xFF, READ[7:], 12)
    assert split(bytearray(READ + READ), 12, 24) == ModbusFrame(0x1501, 0xFF, READ[7:], 24)


@pytest.mark.parametrize("end", range(len(READ)))
def test_waits_for_the_rest(end: int) -> None:
    assert split(bytearray(READ), 0, end) is None


@pytest.mark.parametrize("length", [2, 254])
def test_takes_every_legal_length(length: int) -> None:
    frame = bytearray(encode(1, 1, bytes(length - 1)))
    found = split(frame, 0, len(frame))
    assert found is not None
    assert found.end == len(frame)


@pytest.mark.parametrize(
    "head", ["0001 0001 0006", "0001 0100 0006", "0001 0000 0000", "0001 0000 0001", "0001 0000 00ff"]
)
def test_tells_what_is_no_frame_from_its_first_six_bytes(head: str) -> None:
    with pytest.raises(FramingError):
        split(bytearray(bytes.fromhex(head)), 0, 6)


def test_a_header_that_is_not_whole_is_not_judged() -> None:
    assert split(bytearray(bytes.fromhex("0001 0001 00")), 0, 5) is None


def test_the_buffer_moves_the_rest_to_the_front() -> None:
    buffer = FrameBuffer()
    buffer.space[0][:15] = READ + READ[:3]
    buffer.discard(12, 15)
    assert buffer.end == 3
    assert buffer.data[:3] == READ[:3]
    assert len(buffer.space[0]) == BUFFER_SIZE - 3


def test_the_buffer_never_grows_and_never_fills_up() -> None:
    """The rest is always less than a frame."""
    buffer = FrameBuffer(1)
    assert len(buffer.data) == 2 * MAX_FRAME
    buffer.discard(0, MAX_FRAME - 1)
    assert len(buffer.space[0]) == MAX_FRAME + 1
    assert len(buffer.data) == 2 * MAX_FRAME
