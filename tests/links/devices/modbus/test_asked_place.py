"""Places that somebody types: what is understood, what is refused, and what numbers become."""

from __future__ import annotations

import pytest

from gatewayd.links.access import AccessError, AccessProblem, PlaceRequest
from gatewayd.links.devices.modbus.asked_place import AskedPlace, content_of, place_of
from gatewayd.modbus.areas import Area
from tests.links.devices.cells import device, planned


def place(text: str, type_name: str = "", order: str = "") -> AskedPlace:
    return place_of(PlaceRequest(text, type_name, order))


@pytest.mark.parametrize(
    "text, type_name, expected",
    [
        ("100", "", (Area.HOLDING, 100, 1)),
        ("holding:100..109", "", (Area.HOLDING, 100, 10)),
        ("HOLDING 7", "", (Area.HOLDING, 7, 1)),
        ("input:4", "float32", (Area.INPUT, 4, 2)),
        ("holding:0..7", "float64", (Area.HOLDING, 0, 8)),
        ("coil:0..1999", "", (Area.COIL, 0, 2000)),
        ("discrete:3", "", (Area.DISCRETE, 3, 1)),
        ("65535", "", (Area.HOLDING, 65535, 1)),
    ],
)
def test_place(text: str, type_name: str, expected: tuple[Area, int, int]) -> None:
    found = place(text, type_name)
    assert (found.area, found.address, found.count) == expected


@pytest.mark.parametrize(
    "text, type_name, order, says",
    [
        ("", "", "", "is no place in a Modbus device"),
        ("holding", "", "", "is no place in a Modbus device"),
        ("holding:-1", "", "", "is no place in a Modbus device"),
        ("holding:1..2..3", "", "", "is no place in a Modbus device"),
        ("0x6004", "", "", "is no place in a Modbus device"),
        ("65536", "", "", "is more than one request can read"),
        ("5..4", "", "", "is more than one request can read"),
        ("0..125", "", "", "is more than one request can read"),
        ("coil:0..2000", "", "", "is more than one request can read"),
        ("65535", "int32", "", "is more than one request can read"),
        ("0..2", "int32", "", "of which int32 takes 2 each"),
        ("0", "int8", "", "is no type of registers"),
        ("0", "uint16", "ABDC", "is no order"),
        ("coil:0", "int16", "", "a coil is one bit"),
    ],
)
def test_no_place(text: str, type_name: str, order: str, says: str) -> None:
    with pytest.raises(AccessError, match=says) as raised:
        place(text, type_name, order)
    assert raised.value.problem is AccessProblem.BAD_PLACE


def test_values_of_registers() -> None:
    found = place("10..11").values(bytes.fromhex("0001fffe"))
    assert [(each.place, each.value, each.raw) for each in found] == [
        ("holding 10", 1, "0001"),
        ("holding 11", 65534, "fffe"),
    ]
    (turned,) = place("10", "float32", "CDAB").values(bytes.fromhex("00004148"))
    assert (turned.place, turned.value) == ("holding 10..11", 12.5)
    (text,) = place("0..2", "text").values(b"R2-85\0")
    assert text.value == "R2-85"


def test_values_of_bits() -> None:
    found = place("coil:8..17").values(b"\x01\x02")
    assert [each.value for each in found] == [True, *[False] * 8, True]
    assert found[-1].place == "coil 17"


@pytest.mark.parametrize(
    "text, type_name, value, write, pdus",
    [
        ("20", "", "7", "auto", ["0600140007"]),
        ("20", "", "7", "multiple", ["1000140001020007"]),
        ("20..21", "", "7, 0x10", "auto", ["10001400020400070010"]),
        ("20..21", "", "7,8", "single", ["0600140007", "0600150008"]),
        ("20", "int16", "-2", "read_write", ["17001400010014000102fffe"]),
        ("20", "float32", "12.5", "auto", ["10001400020441480000"]),
        ("20..21", "text", "ab", "auto", ["10001400020461620000"]),
        ("coil:3", "", "on", "auto", ["050003ff00"]),
        ("coil:3..4", "", "off,on", "auto", ["0f000300020102"]),
        ("coil:3..4", "", "off,on", "single", ["0500030000", "050004ff00"]),
    ],
)  # fmt: skip
def test_requests_of_a_write(text: str, type_name: str, value: str, write: str, pdus: list[str]) -> None:
    found = place(text, type_name)
    data, bits = content_of(found, value)
    assert [each.pdu.hex() for each in found.requests(data, bits, write)] == pdus


@pytest.mark.parametrize(
    "text, type_name, value, says",
    [
        ("input:4", "", "1", "has only coils and holding registers"),
        ("discrete:4", "", "on", "has only coils and holding registers"),
        ("4", "", "65536", "not within 0..65535"),
        ("4", "int16", "-32769", "not within -32768..32767"),
        ("4", "float32", "nan", "not within"),
        ("4", "float32", "1e39", "not within"),
        ("4", "", "1.5", "is not a whole number"),
        ("4", "float32", "much", "is not a number"),
        ("4..5", "", "1", "takes 2 values"),
        ("4", "", "1,2", "takes 1 value,"),
        ("coil:4", "", "2", "write on or off"),
        ("0..123", "", "1", "more than the 123"),
        ("0", "text", "long", "holds 2 characters"),
        ("0", "text", "é", "holds 2 characters"),
        ("0", "", "1" * 2001, "is longer than"),
        ("0", "", "9" * 1999, "not within"),
    ],
)
def test_no_value(text: str, type_name: str, value: str, says: str) -> None:
    with pytest.raises(AccessError, match=says):
        content_of(place(text, type_name), value)


def test_variables_at_a_place() -> None:
    plan = planned()
    placements = device(plan, "island").placements

    def names(text: str) -> list[str]:
        return [plan.cell.variables[index].name for index in place(text).mapped(placements)]

    assert names("coil:0") == ["clamp"]
    assert names("coil:1..9") == []
    assert names("holding:0..6") == []
    assert names("holding:7") == ["speed"]
    assert names("holding:0..20") == ["speed"]
    assert names("input:4..9") == ["level"]
