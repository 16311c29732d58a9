"""Numbers, addresses, types and orders as lists write them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.importing.register_list import numbers
from gatewayd.cli.importing.register_list.numbers import Address, NotReadable


@pytest.mark.parametrize(
    "text, comma, value",
    [("0.1", False, 0.1), ("0,1", True, 0.1), (",5", True, 0.5), ("-3", False, -3), ("1e-3", False, 0.001)],
)
def test_numbers(text: str, value: float, *, comma: bool) -> None:
    assert numbers.real(text, comma=comma) == value


def test_thousands_and_decimals_that_look_alike_are_refused() -> None:
    with pytest.raises(NotReadable, match="write 1500 or 1,500"):
        numbers.real("1.500", comma=True)
    assert numbers.real("0.001", comma=True) == 0.001
    assert numbers.real("1.500", comma=False) == 1.5


@pytest.mark.parametrize("text", ["0,1", "1.000,5", "1,000.5", "1'000", "½", "nan", "inf", "", "٣"])
def test_what_may_be_another_number_is_refused(text: str) -> None:
    with pytest.raises(NotReadable):
        numbers.real(text, comma=False)


@pytest.mark.parametrize(
    "text, found",
    [
        ("100", Address(100, None, "")),
        ("0", Address(0, None, "")),
        ("100.3", Address(100, None, "3")),
        ("100.high", Address(100, None, "high")),
        ("0x64", Address(100, None, "", hexadecimal=True)),
        ("64h", Address(100, None, "", hexadecimal=True)),
        ("%MW100", Address(100, None, "")),
        ("mw100.15", Address(100, None, "15")),
        ("400101", Address(100, "holding", "")),
        ("400101.3", Address(100, "holding", "3")),
        ("300001", Address(0, "input", "")),
        ("100001", Address(0, "discrete", "")),
        ("000017", Address(16, "coil", "")),
        ("00017", Address(16, "coil", "")),
        ("465536", Address(65535, "holding", "")),
        ("40101", Address(100, "holding", "", doubtful=True)),
        ("10001", Address(0, "discrete", "", doubtful=True)),
        ("50000", Address(50000, None, "")),
        ("40000", Address(40000, None, "")),
    ],
)
def test_addresses(text: str, found: Address) -> None:
    assert numbers.address(text) == found


@pytest.mark.parametrize(
    "text",
    [
        "",
        "-1",
        "65536",
        "70000",
        "400000",
        "500001",
        "000000",
        "1.2.3",
        "100.x",
        "0x10000",
        "4x0101",
        "DB10.DBW4",
    ],
)
def test_no_addresses(text: str) -> None:
    with pytest.raises(NotReadable):
        numbers.address(text)


@given(st.text(max_size=12))
def test_every_text_is_an_address_or_refused(text: str) -> None:
    try:
        found = numbers.address(text)
    except NotReadable:
        return
    assert -1 <= found.number <= numbers.MAX_ADDRESS


@pytest.mark.parametrize(
    "text, area",
    [("Holding Register", "holding"), ("Halteregister", "holding"), ("4x", "holding"), ("Coil", "coil"),
     ("Discrete Input", "discrete"), ("input registers", "input"), ("Eingangsregister", "input")],
)  # fmt: skip
def test_areas(text: str, area: str) -> None:
    assert numbers.area(text) == area


@pytest.mark.parametrize(
    "text, area",
    [("3", "holding"), ("FC03", "holding"), ("0x04", "input"), ("FC 1", "coil"), ("02", "discrete")],
)
def test_function_codes(text: str, area: str) -> None:
    assert numbers.function_area(text) == area


@pytest.mark.parametrize(
    "text, kind",
    [("DINT", "int32"), ("UDINT", "uint32"), ("REAL", "float32"), ("LREAL", "float64"), ("WORD", "uint16"),
     ("Float64", "float64"), ("BOOL", "bool")],
)  # fmt: skip
def test_types(text: str, kind: str) -> None:
    assert numbers.number_type(text) == (kind, False)


def test_types_that_differ_between_languages_are_doubtful() -> None:
    assert numbers.number_type("INT") == ("int16", True)
    assert numbers.number_type("Float") == ("float32", True)


@pytest.mark.parametrize("text, order", [("big-endian", "ABCD"), ("CDAB", "CDAB"), ("Word swap", "CDAB")])
def test_orders(text: str, order: str) -> None:
    assert numbers.word_order(text) == order


@pytest.mark.parametrize("text", ["little-endian", "Intel", ""])
def test_orders_that_are_said_in_several_ways_are_refused(text: str) -> None:
    """Little-endian may swap the words, the bytes or both."""
    with pytest.raises(NotReadable):
        numbers.word_order(text)
