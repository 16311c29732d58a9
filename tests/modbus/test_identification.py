from __future__ import annotations

import pytest

from gatewayd import __version__
from gatewayd.modbus.frames import MAX_PDU
from gatewayd.modbus.identification import Identification, ReadCode

CELL = "press-3"


def ask(unit: Identification, code: int, first: int = 0) -> bytes | int:
    return unit.answer(bytes((43, 14, code, first)))


def objects(answer: bytes | int) -> dict[int, str]:
    assert isinstance(answer, bytes)
    found = {}
    position = 7
    for _ in range(answer[6]):
        key, size = answer[position], answer[position + 1]
        found[key] = answer[position + 2 : position + 2 + size].decode()
        position += 2 + size
    assert position == len(answer)
    return found


@pytest.fixture
def unit() -> Identification:
    return Identification(CELL, 0x1234ABCD)


def test_the_basic_stream_has_the_mandatory_objects(unit: Identification) -> None:
    assert objects(ask(unit, ReadCode.BASIC)) == {0: "gatewayd", 1: "gatewayd", 2: __version__}


def test_the_regular_stream_has_the_named_objects(unit: Identification) -> None:
    found = objects(ask(unit, ReadCode.REGULAR))
    assert list(found) == [0, 1, 2, 3, 4, 5, 6]
    assert found[5] == CELL


def test_the_extended_stream_tells_the_mapping(unit: Identification) -> None:
    assert objects(ask(unit, ReadCode.EXTENDED))[0x80] == "1234abcd"


@pytest.mark.parametrize("code", [ReadCode.BASIC, ReadCode.REGULAR, ReadCode.EXTENDED])
def test_a_stream_begins_where_it_is_asked_to(unit: Identification, code: int) -> None:
    assert next(iter(objects(ask(unit, code, 2)))) == 2


@pytest.mark.parametrize("code,first", [(1, 3), (1, 0x80), (2, 7), (2, 0x80), (3, 0x60)])
def test_a_stream_from_an_unknown_object_begins_anew(unit: Identification, code: int, first: int) -> None:
    assert ask(unit, code, first) == ask(unit, code, 0)


def test_one_object_is_read_by_itself(unit: Identification) -> None:
    assert objects(ask(unit, ReadCode.INDIVIDUAL, 0x80)) == {0x80: "1234abcd"}


@pytest.mark.parametrize("first", [7, 0x7F, 0x81, 0xFF])
def test_one_unknown_object_has_no_address(unit: Identification, first: int) -> None:
    assert ask(unit, ReadCode.INDIVIDUAL, first) == 0x02


@pytest.mark.parametrize("pdu", ["2b 0e 00 00", "2b 0e 05 00", "2b 0e 01", "2b 0e 01 00 00"])
def test_a_wrong_code_or_length_is_an_illegal_value(unit: Identification, pdu: str) -> None:
    assert unit.answer(bytes.fromhex(pdu)) == 0x03


@pytest.mark.parametrize("size", [1, 100, 190, 243, 244, 245, 1000])
def test_long_objects_are_told_in_several_answers(size: int) -> None:
    """MoreFollows and NextObjectId lead through all of them, none is over the size of a PDU."""
    unit = Identification("x" * size, 1, "y" * 200)
    found: dict[int, str] = {}
    first = 0
    while True:
        answer = ask(unit, ReadCode.EXTENDED, first)
        assert isinstance(answer, bytes)
        assert len(answer) <= 253
        found |= objects(answer)
        if not answer[4]:
            assert answer[5] == 0
            break
        first = answer[5]
        assert first not in found
    assert list(found) == [0, 1, 2, 3, 4, 5, 6, 0x80]
    assert found[5] == "x" * min(size, 244)


def test_server_id_is_the_unit_the_indicator_and_a_text() -> None:
    identification = Identification("press-3", 1)
    text = f"gatewayd {__version__} press-3".encode()
    assert identification.server_id(7, running=True) == bytes((17, 2 + len(text), 7, 0xFF)) + text
    assert identification.server_id(7, running=False)[3] == 0


def test_a_long_name_is_cut_to_what_a_frame_holds() -> None:
    answer = Identification("x" * 500, 1).server_id(1, running=True)
    assert (len(answer), answer[1]) == (MAX_PDU, MAX_PDU - 2)
