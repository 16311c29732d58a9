"""The data sheet: the same bytes every time, and what an importer reads is what the node has."""

from __future__ import annotations

import os
import struct
from configparser import RawConfigParser
from io import StringIO
from itertools import chain
from pathlib import Path
from typing import Any

import canopen
import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, ObjectCode, Pdo, array, variable
from gatewayd.canopen.importer import differences
from gatewayd.links.canopen_node.eds import Sheet, dcf_text, eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

ROOT = Path(__file__).parents[3]
GOLDEN = Path(__file__).parent / "golden" / "two-buses.eds"
MAPPING = ROOT / "mappings" / "two-buses.yaml"
NODE = 20
OTHER_NODE = 77
SHEET = Sheet("test", 0x1234_5678, NODE, 500_000)


@pytest.fixture(scope="module")
def plan() -> Plan:
    found = load(MAPPING.read_bytes(), MAPPING.name).plan
    assert found is not None
    return found


@pytest.fixture(scope="module")
def dictionary(plan: Plan) -> Dictionary:
    assert canopen_of(plan) is not None
    return objects_of(plan.the(CanopenPlan), plan.cell)


@pytest.fixture(scope="module")
def text(plan: Plan, dictionary: Dictionary) -> str:
    assert canopen_of(plan) is not None
    return eds_text(dictionary, sheet_of(plan.the(CanopenPlan), plan.cell))


class _File(StringIO):
    """An open file: the importer looks at the name."""

    name = "cell.eds"


def imported(text: str, node: int | None = NODE) -> Any:
    return canopen.import_od(_File(text), node_id=node)


def parsed(text: str) -> RawConfigParser:
    parser = RawConfigParser()
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read_string(text)
    return parser


def test_golden(text: str) -> None:
    """A change of the data sheet is a change for every master that imported it. GOLDEN=write rewrites the file."""
    if os.environ.get("GOLDEN") == "write":
        GOLDEN.write_text(text, encoding="ascii", newline="\n")
    assert text == GOLDEN.read_text(encoding="ascii")


def test_same_mapping_same_bytes(plan: Plan, text: str) -> None:
    assert canopen_of(plan) is not None
    assert (
        eds_text(objects_of(plan.the(CanopenPlan), plan.cell), sheet_of(plan.the(CanopenPlan), plan.cell))
        == text
    )


def test_every_entry_comes_back_as_it_is(dictionary: Dictionary, text: str) -> None:
    """Name, type, access, default and PDO flag of every sub-index, by python-canopen's importer."""
    assert differences(text, dictionary, NODE) == ()
    assert sum(len(one.entries) for one in dictionary) > 500
    assert set(imported(text)) - {one.index for one in dictionary} == set(range(2, 8)), "dummy entries"


def test_cob_ids_follow_the_node_id(text: str) -> None:
    """What is predefined moves with the node-ID, what was declared stays."""
    od = imported(text, OTHER_NODE)
    assert od[0x1014].default == 0x80 + OTHER_NODE
    assert od[0x1400][1].default & 0x7FF == 0x200 + OTHER_NODE
    assert od[0x1801][1].default & 0x7FF == 0x280 + OTHER_NODE
    assert od[0x1802][1].default & 0x7FF == 0x1C0
    assert "DefaultValue=$NODEID+0x80\n" in text


def test_device_information(text: str) -> None:
    device = imported(text).device_information
    assert device.LSS_supported is True
    assert device.allowed_baudrates == {10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000}
    assert (device.nr_of_RXPDO, device.nr_of_TXPDO) == (4, 4)
    assert device.simple_boot_up_slave is True
    assert device.product_number == 0x4757_4401


def test_names_are_those_of_the_cell(text: str) -> None:
    device = parsed(text)["DeviceInfo"]
    assert (device["ProductName"], device["OrderCode"]) == ("gatewayd two-buses", "two-buses")
    assert imported(text)[0x1008].default == "gatewayd two-buses"


@pytest.mark.parametrize("pdo, granularity", [(Pdo.TRANSMIT, "1"), (Pdo.NONE, "8")])
def test_granularity_is_the_smallest_thing_that_can_be_mapped(pdo: Pdo, granularity: str) -> None:
    bit = Entry(0, "bit", CanType.BOOLEAN, Access.RO, b"\0", pdo=pdo)
    byte = Entry(0, "byte", CanType.UNSIGNED8, Access.RO, b"\0", pdo=Pdo.TRANSMIT)
    text = eds_text([variable(0x2000, bit), variable(0x2001, byte)], SHEET)
    assert parsed(text)["DeviceInfo"]["Granularity"] == granularity


def test_what_is_constant_has_its_default_and_what_is_volatile_none(
    dictionary: Dictionary, text: str
) -> None:
    """A default that is not what is read is a fault for whoever compares; 0 may lie below the low limit."""
    od = imported(text)
    for item in dictionary:
        for entry in item.entries:
            found = od[item.index] if item.code is ObjectCode.VAR else od[item.index][entry.subindex]
            if entry.is_volatile:
                assert found.default is None, entry.name
            elif entry.type.size is not None:
                assert entry.type.pack(found.default) == entry.read(), entry.name
                assert found.min is None or found.default >= found.min, entry.name
    assert od[0x5F00][1].default == 1, "the layout of the status block"


def test_every_object_is_listed_once_in_its_part(dictionary: Dictionary, text: str) -> None:
    """CiA 306: mandatory are 1000h, 1001h and 1018h, manufacturer's are 2000h to 5FFFh."""
    parser = parsed(text)
    listed: dict[str, list[int]] = {}
    for part in ("Mandatory", "Optional", "Manufacturer"):
        pairs = dict(parser[f"{part}Objects"])
        count = int(pairs.pop("SupportedObjects"))
        assert list(pairs) == [str(number) for number in range(1, count + 1)]
        listed[part] = [int(index, 16) for index in pairs.values()]
    assert listed["Mandatory"] == [0x1000, 0x1001, 0x1018]
    assert all(0x2000 <= index < 0x6000 for index in listed["Manufacturer"])
    assert sorted(chain(*listed.values())) == [one.index for one in dictionary]
    for one in dictionary:
        section = parser[f"{one.index:04X}"]
        assert int(section["ObjectType"], 0) == one.code
        if one.code is not ObjectCode.VAR:
            assert int(section["SubNumber"], 0) == len(one.entries)


def test_dates_are_fixed(text: str) -> None:
    """Nothing in the file depends on when it was made."""
    info = parsed(text)["FileInfo"]
    assert (info["CreationDate"], info["ModificationTime"]) == ("01-01-2026", "12:00AM")
    assert info["EDSVersion"] == "4.0"


def one(entry: Entry) -> Any:
    return imported(eds_text([variable(0x2000, entry)], SHEET))[0x2000]


@pytest.mark.parametrize(
    "can_type, value",
    [
        (CanType.BOOLEAN, True),
        (CanType.INTEGER8, -128),
        (CanType.INTEGER16, -2),
        (CanType.INTEGER32, -(2**31)),
        (CanType.INTEGER64, -(2**63)),
        (CanType.UNSIGNED8, 255),
        (CanType.UNSIGNED64, 2**64 - 1),
        (CanType.REAL64, 0.0),
        (CanType.REAL64, -0.1),
        (CanType.REAL32, 1.5),
    ],
)
def test_numbers_survive_with_their_sign(can_type: CanType, value: float) -> None:
    assert one(Entry(0, "x", can_type, Access.RW, can_type.pack(value))).default == value


def test_a_real32_is_written_exactly() -> None:
    """Enough digits to get the same bits back."""
    raw = struct.pack("<f", 0.1)
    assert struct.pack("<f", one(Entry(0, "x", CanType.REAL32, Access.RW, raw)).default) == raw


@pytest.mark.parametrize(
    "can_type, low, high",
    [(CanType.INTEGER16, -5, 7), (CanType.UNSIGNED32, 0, 999), (CanType.INTEGER64, -(2**40), 2**40)],
)
def test_limits(can_type: CanType, low: int, high: int) -> None:
    found = one(Entry(0, "x", can_type, Access.RWW, bytes(can_type.size or 0), low=low, high=high))
    assert (found.min, found.max) == (low, high)


def test_limits_of_reals_are_left_out() -> None:
    """Lely's dcfchk and python-canopen do not agree about how a real is written."""
    entry = Entry(0, "x", CanType.REAL64, Access.RWW, bytes(8), low=-0.5, high=1.5)
    assert "Limit" not in eds_text([variable(0x2000, entry)], SHEET)


def test_fractional_limits_of_integers_are_narrowed() -> None:
    found = one(Entry(0, "x", CanType.INTEGER16, Access.RWW, bytes(2), low=-0.5, high=7.5))
    assert (found.min, found.max) == (0, 7)


@pytest.mark.parametrize("access", list(Access))
def test_access_types(access: Access) -> None:
    assert one(Entry(0, "x", CanType.UNSIGNED8, access, b"\0")).access_type == access.value


def test_a_domain_has_no_default() -> None:
    text = eds_text([variable(0x2000, Entry(0, "x", CanType.DOMAIN, Access.RO))], SHEET)
    assert "ObjectType=0x2\nDataType=0x000F" in text
    assert "DefaultValue" not in text


def test_sub_indices_with_gaps_are_counted_not_numbered() -> None:
    entries = [Entry(number, f"e{number}", CanType.UNSIGNED8, Access.RO, b"\0") for number in (1, 2, 5)]
    od = imported(eds_text([array(0x2000, "sparse", entries)], SHEET))
    assert sorted(od[0x2000].subindices) == [0, 1, 2, 5]
    assert "SubNumber=0x4" in eds_text([array(0x2000, "sparse", entries)], SHEET)


def test_configuration_of_a_commissioned_node(plan: Plan, dictionary: Dictionary) -> None:
    """Node-ID, bit-rate, and the value of whatever the node stores; nothing of what it only shows."""
    assert canopen_of(plan) is not None
    text = dcf_text(dictionary, sheet_of(plan.the(CanopenPlan), plan.cell))
    od = imported(text, None)
    assert (od.node_id, od.bitrate) == (NODE, 500_000)
    assert od[0x1400][1].value == 0x200 + NODE
    assert od[0x1017].value == 500
    assert parsed(text)["FileInfo"]["LastEDS"] == "two-buses.eds"
    parser = parsed(text)
    assert parser.has_option("1A00sub1", "ParameterValue")
    assert not parser.has_option("1001", "ParameterValue")
    assert not parser.has_option("2000sub1", "ParameterValue")
