from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.modbus.areas import Area
from gatewayd.modbus.describe import Span, answer_text, fault, function_text, reading, request_text, writing


@pytest.mark.parametrize(
    "pdu, text",
    [
        ("01 0000 000a", "read coil 0-9"),
        ("02 0003 0001", "read discrete 3"),
        ("03 0064 0004", "read holding 100-103"),
        ("04 0000 007d", "read input 0-124"),
        ("05 000a ff00", "write coil 10 = 1"),
        ("05 000a 0000", "write coil 10 = 0"),
        ("06 000a 0007", "write holding 10 = 7"),
        ("0f 0000 000a 02 ff03", "write coil 0-9 = 1 1 1 1 1 1 1 1 1 1"),
        ("10 000a 0002 04 0001 ffff", "write holding 10-11 = 1 65535"),
        ("16 000a 00f2 0025", "write holding 10 with masks AND 00F2h, OR 0025h"),
        ("17 0064 0002 000a 0001 02 0009", "read holding 100-101, write holding 10 = 9"),
        ("08 0000 1234", "function 8 (diagnostics): 00 00 12 34"),
        ("2b 0e 01 00", "function 43 (encapsulated interface): 0e 01 00"),
        ("63", "function 99"),
        ("", "function 0"),
    ],
)
def test_requests(pdu: str, text: str) -> None:
    assert request_text(bytes.fromhex(pdu)) == text


@pytest.mark.parametrize(
    "pdu, text",
    [
        ("03 0064 0000", "quantity 0 is not within 1 to 125"),
        ("03 0064 007e", "quantity 126 is not within 1 to 125"),
        ("01 0064 07d1", "quantity 2001 is not within 1 to 2000"),
        ("03 0064 00", "length 4 instead of 5"),
        ("05 0064 0001", "a coil is written with 0 or FF00h, not with 0001h"),
        ("10 0064 0000 00", "quantity 0 is not within 1 to 123"),
        ("10 0064 0002 02 0001", "its data does not fit quantity 2, which needs length 4"),
        ("0f 0064 0009 01 ff", "its data does not fit quantity 9, which needs length 2"),
        ("17 0064 0001 000a 007a f4", "quantity 122 is not within 1 to 121"),
        ("10 00", "too short, length 2"),
        ("03 0064 0001", ""),
        ("63 00", ""),
    ],
)
def test_what_is_wrong(pdu: str, text: str) -> None:
    assert fault(bytes.fromhex(pdu)) == text


@pytest.mark.parametrize(
    "request_pdu, pdu, text",
    [
        ("03 0064 0002", "03 04 0001 0002", "holding 100-101 = 1 2"),
        ("01 0000 000a", "01 02 ff03", "coil 0-9 = 1 1 1 1 1 1 1 1 1 1"),
        ("17 0064 0001 000a 0001 02 0009", "17 02 0005", "holding 100 = 5"),
        (
            "03 0064 0002",
            "83 02",
            "refused with 02h illegal data address: function 3 (read holding registers)",
        ),
        ("10 000a 0002 04 0001 ffff", "10 000a 0002", "written holding 10-11"),
        ("06 000a 0007", "06 000a 0007", "written holding 10"),
        ("03 0064 0002", "04 04 0001 0002", "function 4 (read input registers): 04 00 01 00 02"),
        (None, "03 04 0001 0002", "function 3 (read holding registers): 04 00 01 00 02"),
        ("03 0064 0002", "83", "refused with 00h exception: function 3 (read holding registers)"),
    ],
)
def test_answers(request_pdu: str | None, pdu: str, text: str) -> None:
    request = None if request_pdu is None else bytes.fromhex(request_pdu)
    assert answer_text(bytes.fromhex(pdu), request) == text


def test_spans() -> None:
    pdu = bytes.fromhex("17 0064 0002 000a 0001 02 0009")
    assert reading(pdu) == Span(Area.HOLDING, 100, 2)
    assert writing(pdu) == Span(Area.HOLDING, 10, 1)
    assert function_text(pdu) == "function 23 (read and write registers)"


def test_long_lists_of_values_are_cut_short() -> None:
    assert answer_text(bytes([3, 250]) + bytes(250), bytes.fromhex("03 0000 007d")).endswith(" 0 0 ...")


@given(st.binary(max_size=260), st.one_of(st.none(), st.binary(max_size=260)))
def test_any_bytes_have_a_description(pdu: bytes, request: bytes | None) -> None:
    for text in (request_text(pdu), answer_text(pdu, request)):
        assert text.isprintable()
        assert len(text) < 200
    assert isinstance(fault(pdu), str)
