from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client import requests
from gatewayd.modbus.client.requests import BadAnswer, ExceptionAnswer, ModbusRequest, parse_answer

# Requests and answers of the Application Protocol V1.1b3, 6.1 to 6.17.
EXAMPLES = {
    "FC 1": (requests.read(Area.COIL, 19, 19), "0100130013", "0103cd6b05", "cd6b05"),
    "FC 2": (requests.read(Area.DISCRETE, 196, 22), "0200c40016", "0203acdb35", "acdb35"),
    "FC 3": (requests.read(Area.HOLDING, 107, 3), "03006b0003", "0306022b00000064", "022b00000064"),
    "FC 4": (requests.read(Area.INPUT, 8, 1), "0400080001", "0402000a", "000a"),
    "FC 5": (requests.write_coil(172, True), "0500acff00", "0500acff00", ""),
    "FC 6": (requests.write_register(1, b"\x00\x03"), "0600010003", "0600010003", ""),
    "FC 15": (
        requests.write_coils(19, tuple(bit == "1" for bit in "1011001110")),
        "0f0013000a02cd01",
        "0f0013000a",
        "",
    ),
    "FC 16": (requests.write_registers(1, b"\x00\x0a\x01\x02"), "100001000204000a0102", "1000010002", ""),
    "FC 22": (requests.mask_register(4, 0xF2, 0x25), "16000400f20025", "16000400f20025", ""),
    "FC 23": (
        requests.read_write(3, 6, 14, b"\x00\xff" * 3),
        "1700030006000e00030600ff00ff00ff",
        "170c00fe0acd00010003000d00ff",
        "00fe0acd00010003000d00ff",
    ),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_of_the_specification(name: str) -> None:
    request, sent, answer, data = EXAMPLES[name]
    assert request.pdu.hex() == sent
    assert parse_answer(request, bytes.fromhex(answer)) == bytes.fromhex(data)
    assert request.is_write == (request.function not in (1, 2, 3, 4))


@pytest.mark.parametrize("name", EXAMPLES)
def test_nothing_but_the_whole_answer_is_one(name: str) -> None:
    request, _, answer, _ = EXAMPLES[name]
    whole = bytes.fromhex(answer)
    for cut in range(len(whole)):
        assert isinstance(parse_answer(request, whole[:cut]), BadAnswer)
    assert isinstance(parse_answer(request, whole + b"\0"), BadAnswer)
    assert isinstance(parse_answer(request, bytes((whole[0] ^ 1,)) + whole[1:]), BadAnswer)


@pytest.mark.parametrize("name", ["FC 5", "FC 6", "FC 15", "FC 16", "FC 22"])
def test_another_echo_confirms_nothing(name: str) -> None:
    request, _, answer, _ = EXAMPLES[name]
    echo = bytes.fromhex(answer)
    for place in range(1, len(echo)):
        other = bytearray(echo)
        other[place] ^= 1
        outcome = parse_answer(request, bytes(other))
        assert isinstance(outcome, BadAnswer)
        assert "begins with" in outcome.text


def test_byte_count_of_another_length_is_refused() -> None:
    request = requests.read(Area.HOLDING, 0, 2)
    assert isinstance(parse_answer(request, bytes.fromhex("030312345678")), BadAnswer)


@pytest.mark.parametrize(
    "code, text, is_no_answer",
    [
        (2, "exception 02 (illegal data address)", False),
        (0x0B, "exception 0B (gateway target device failed to respond)", True),
        (0x0A, "exception 0A (gateway path unavailable)", True),
        (0x77, "exception 77 (unknown)", False),
    ],
)
def test_exceptions_in_words(code: int, text: str, is_no_answer: bool) -> None:
    outcome = parse_answer(requests.read(Area.HOLDING, 0, 1), bytes((0x83, code)))
    assert outcome == ExceptionAnswer(code)
    assert isinstance(outcome, ExceptionAnswer)
    assert (outcome.text, outcome.is_no_answer) == (text, is_no_answer)


@given(st.sampled_from(sorted(EXAMPLES)), st.binary(max_size=300))
def test_whatever_comes_is_data_or_a_failure(name: str, answer: bytes) -> None:
    request = EXAMPLES[name][0]
    outcome = parse_answer(request, answer)
    if isinstance(outcome, bytes):
        assert len(answer) == request.answer_size
        assert answer[0] == request.function


def _registers(count: int) -> bytes:
    return bytes(2 * count)


TOO_MUCH: dict[str, Callable[[], ModbusRequest]] = {
    "registers": lambda: requests.read(Area.HOLDING, 0, 126),
    "coils": lambda: requests.read(Area.COIL, 0, 2001),
    "nothing": lambda: requests.read(Area.COIL, 0, 0),
    "behind the end": lambda: requests.read(Area.INPUT, 65535, 2),
    "before the beginning": lambda: requests.read(Area.INPUT, -1, 2),
    "write registers": lambda: requests.write_registers(0, _registers(124)),
    "write none": lambda: requests.write_registers(0, b""),
    "half a register": lambda: requests.write_registers(0, b"\0"),
    "two registers by FC 6": lambda: requests.write_register(0, b"\0\0\0\0"),
    "write coils": lambda: requests.write_coils(0, (True,) * 1969),
    "FC 23 writes": lambda: requests.read_write(0, 1, 0, _registers(122)),
    "FC 23 reads": lambda: requests.read_write(0, 126, 0, _registers(1)),
    "address": lambda: requests.write_coil(65536, True),
    "object": lambda: requests.read_identification(256),
}


@pytest.mark.parametrize("name", TOO_MUCH)
def test_what_no_request_can_say_is_not_made(name: str) -> None:
    with pytest.raises(ValueError, match=r"\d"):
        TOO_MUCH[name]()


def test_greatest_requests_fit_into_a_pdu() -> None:
    greatest: list[ModbusRequest] = [
        requests.write_registers(65413, _registers(123)),
        requests.write_coils(0, (True,) * 1968),
        requests.read_write(0, 125, 0, _registers(121)),
    ]
    assert [len(request.pdu) for request in greatest] == [252, 252, 252]
    assert requests.read(Area.HOLDING, 0, 125).answer_size == 252
    assert requests.read(Area.COIL, 0, 2000).answer_size == 252
