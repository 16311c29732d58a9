from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.machine.der import OBJECT_IDENTIFIER, DerError, Element, elements, identifier, only


def test_elements_lie_within_one_another() -> None:
    outer = only(bytes.fromhex("3006 020105 0c0141"))
    number, text = outer.expect(0x30)
    assert (number.tag, number.content, number.whole) == (2, b"\x05", b"\x02\x01\x05")
    assert text == Element(0x0C, b"A", b"\x0c\x01A")


def test_a_length_of_several_bytes() -> None:
    assert only(b"\x04\x81\x80" + bytes(128)).content == bytes(128)
    assert only(b"\x04\x82\x01\x00" + bytes(256)).content == bytes(256)


@pytest.mark.parametrize(
    "data",
    ["02", "0205", "0281", "028101ff", "0280", "04820001", "0485000000000141", "1f8101", "02020500ff", ""],
)
def test_what_is_not_der_is_refused(data: str) -> None:
    with pytest.raises(DerError):
        only(bytes.fromhex(data)).expect(2)


@pytest.mark.parametrize(
    "data, text",
    [
        ("550403", "2.5.4.3"),
        ("2b0601040183890c862201", "1.3.6.1.4.1.50316.802.1"),
        ("2a864886f70d", "1.2.840.113549"),
        ("883701", "2.999.1"),
    ],
)
def test_identifiers(data: str, text: str) -> None:
    content = bytes.fromhex(data)
    assert identifier(Element(OBJECT_IDENTIFIER, content, b"")) == text


@pytest.mark.parametrize("data", ["", "80", "558001", "5581", "01" * 65])
def test_what_is_no_identifier_is_refused(data: str) -> None:
    with pytest.raises(DerError):
        identifier(Element(OBJECT_IDENTIFIER, bytes.fromhex(data), b""))


@given(st.binary(max_size=200))
def test_whatever_the_bytes_are_reading_ends(data: bytes) -> None:
    try:
        found = list(elements(data))
    except DerError:
        return
    assert b"".join(element.whole for element in found) == data
