"""Objects that somebody types: what is understood, what is refused, and what bytes become."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import AccessError, AccessProblem, PlaceRequest
from gatewayd.links.devices.canopen.asked_object import AskedObject, object_of, refuse_carried
from tests.links.devices.canopen.cells import planned, the_device


def asked(text: str, type_name: str = "") -> AskedObject:
    return object_of(PlaceRequest(text, type_name))


@pytest.mark.parametrize(
    "text, expected",
    [
        ("0x6004", (0x6004, 0)),
        ("0x1018:4", (0x1018, 4)),
        ("1018h:04h", (0x1018, 4)),
        ("1A00h:10h", (0x1A00, 16)),
        ("object:0x2000:255", (0x2000, 255)),
    ],
)
def test_object(text: str, expected: tuple[int, int]) -> None:
    found = asked(text)
    assert (found.index, found.subindex) == expected


@pytest.mark.parametrize(
    "text", ["", "6004", "0x0004", "0x60040", "0x6004:256", "0x6004:-1", "coil:0", "0x6004:1:2"]
)
def test_no_object(text: str) -> None:
    with pytest.raises(AccessError, match="is no object of a CANopen device") as raised:
        asked(text)
    assert raised.value.problem is AccessProblem.BAD_PLACE


def test_type_and_order_of_an_object() -> None:
    with pytest.raises(AccessError, match="is no type of an object"):
        asked("0x6004", "int24")
    with pytest.raises(AccessError, match="no --order"):
        object_of(PlaceRequest("0x6004", order="CDAB"))


@pytest.mark.parametrize(
    "type_name, data, value",
    [
        ("", "2a", 42),
        ("", "e803", 1000),
        ("", "960102 00", 0x20196),
        ("", "0102030405060708", 0x0807060504030201),
        ("", "456e636f646572", "Encoder"),
        ("", "010203", "01 02 03"),
        ("", "", ""),
        ("int16", "ffff", -1),
        ("int16", "ffff0000", -1),
        ("float32", "00004841", 12.5),
        ("bool", "01", True),
        ("text", "41420000", "AB"),
        ("hex", "4142", "41 42"),
    ],
)
def test_value(type_name: str, data: str, value: object) -> None:
    assert asked("0x2000", type_name).value(bytes.fromhex(data)).value == value


def test_value_of_another_length() -> None:
    with pytest.raises(AccessError, match="holds 2 bytes"):
        asked("0x2000", "int32").value(b"\1\2")


@pytest.mark.parametrize(
    "type_name, former, text, data",
    [
        ("", b"\0\0", "1000", "e803"),
        ("uint8", None, "0x10", "10"),
        ("int16", None, "-1", "ffff"),
        ("float32", None, "12.5", "00004841"),
        ("bit", None, "on", "01"),
        ("text", None, "AB", "4142"),
        ("hex", None, "41 42", "4142"),
    ],
)
def test_content(type_name: str, former: bytes | None, text: str, data: str) -> None:
    assert asked("0x2000", type_name).content(text, former).hex() == data


@pytest.mark.parametrize(
    "type_name, former, text, says",
    [
        ("", None, "1", "say it with --type"),
        ("", b"\1\2\3", "1", "say it with --type"),
        ("", b"\0", "256", "is no value of the type uint8"),
        ("uint8", None, "-1", "is no value of the type uint8"),
        ("float32", None, "1e39", "is no value of the type float32"),
        ("int16", None, "1.5", "is no value of the type int16"),
        ("bool", None, "2", "write on or off"),
        ("hex", None, "4", "no hexadecimal digits"),
        ("text", None, "x" * 2001, "is longer than"),
    ],
)
def test_no_content(type_name: str, former: bytes | None, text: str, says: str) -> None:
    with pytest.raises(AccessError, match=says):
        asked("0x2000", type_name).content(text, former)


def test_what_is_mapped_or_sent_along_is_refused() -> None:
    plan = planned()
    device = the_device(plan)

    def refusal(text: str, cell: CellDefinition = plan.cell) -> str:
        with pytest.raises(AccessError) as raised:
            refuse_carried(asked(text), device, cell)
        assert raised.value.problem is AccessProblem.MAPPED
        return str(raised.value)

    assert "use `gatewayd force clamp VALUE`" in refusal("0x6200:1")
    assert "use `gatewayd force preset VALUE`" in refusal("0x2000")
    refuse_carried(asked("0x2003"), device, plan.cell)
    along = [
        (item.index, item.subindex)
        for pdo in device.node.pdos
        if not pdo.transmit
        for item in pdo.objects
        if (item.index, item.subindex) not in {(place.index, place.subindex) for place in device.places}
    ]
    for index, subindex in along:
        assert "the gateway sends it in PDO" in refusal(f"0x{index:04X}:{subindex}")
