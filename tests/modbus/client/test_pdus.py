from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.pdu import DecodePDU

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.requests import parse_answer, read

ANSWER = "0e01010000" + "03" + "00026764" + "01026d62" + "0203312e30"
"""An identification with three objects, behind the function code and the MEI type."""


def _answer() -> bytes:
    return bytes.fromhex(ANSWER)[1:]


def test_identification_is_taken_apart() -> None:
    assert pdus.identification(_answer()) == ({0: b"gd", 1: b"mb", 2: b"1.0"}, None)


def test_identification_that_goes_on_says_where() -> None:
    data = bytearray(_answer())
    data[2:4] = 0xFF, 0x05
    assert pdus.identification(bytes(data))[1] == 5


@given(st.binary(max_size=260))
def test_whatever_comes_is_an_identification_or_a_value_error(data: bytes) -> None:
    try:
        objects, following = pdus.identification(data)
    except ValueError:
        return
    assert all(isinstance(content, bytes) for content in objects.values())
    assert following is None or 0 <= following <= 255


@given(st.binary(max_size=300))
def test_size_of_an_identification_on_a_serial_line(beginning: bytes) -> None:
    size = pdus.identification_frame_size(b"\x01\x2b\x0e" + beginning)
    assert 10 <= size <= 257


def test_check_of_the_specification() -> None:
    """Serial Line V1.02, 6.2.2: address 2, function 7 -> 41h 12h."""
    assert pdus.crc(b"\x02\x07") == b"\x41\x12"


@given(st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=125))
def test_registers_are_those_that_pymodbus_decodes(registers: list[int]) -> None:
    """The client takes the bytes as they are; pymodbus's own decoder is the second opinion."""
    data = b"".join(register.to_bytes(2) for register in registers)
    pdu = bytes((3, len(data))) + data
    theirs = DecodePDU(is_server=False).decode(pdu)
    assert theirs is not None
    assert parse_answer(read(Area.HOLDING, 0, len(registers)), pdu) == data
    assert list(theirs.registers) == registers


@pytest.mark.parametrize("function", [1, 2, 3, 4])
def test_too_much_for_one_request_is_refused_by_pymodbus_too(function: int) -> None:
    with pytest.raises(ValueError, match="count"):
        pdus.read(function, 0, 2001)
