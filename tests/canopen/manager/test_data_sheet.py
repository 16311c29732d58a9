"""Data sheets as they should be, and as vendors make them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.manager.data_sheet import DataSheet, DataSheetError
from gatewayd.canopen.manager.plan import ExpectedIdentity, ManagedPdo, PdoObject, Setting
from tests.canopen.manager.sheets import FILE, entry

NODE = 5


def sheet(*more: str, text: str = FILE) -> DataSheet:
    return DataSheet((text + "".join(more)).encode(), NODE)


def test_a_good_sheet() -> None:
    read = sheet()
    assert read.identity == ExpectedIdentity(0x20196, 0x1F0, 0x401)
    assert read.pdos() == (
        ManagedPdo(
            1,
            True,
            0x185,
            (PdoObject(0x6004, 0, 32, CanType.UNSIGNED32),),
            transmission=254,
            no_remote=True,
        ),
    )
    assert not read.is_fixed(1, transmit=True)
    assert read.modified == (14611, 55_800_000)
    found = read.find(0x6004, 0)
    assert found is not None
    assert (found.text, found.type, found.bits) == ("6004h:00 Position value", CanType.UNSIGNED32, 32)
    assert (found.transmitted, found.received, found.writable) == (True, False, False)
    assert read.find(0x6004, 1) is None
    assert read.find(0x7777, 0) is None


# -- what vendors do -------------------------------------------------------------------------------------------------


def test_blank_pdo_mapping_is_none() -> None:
    found = sheet(entry("2000", 5, PDOMapping="")).find(0x2000, 0)
    assert found is not None
    assert not found.mappable


@pytest.mark.parametrize("key", ["DefaultValue", "LowLimit", "HighLimit", "ParameterValue"])
def test_blank_values_are_missing(key: str) -> None:
    found = sheet(entry("2000", 5, **{key: ""})).find(0x2000, 0)
    assert found is not None
    assert (found.default, found.value) == (None, None)


def test_blank_keys_of_the_device_and_blank_names() -> None:
    text = FILE.replace("BaudRate_500=1", "BaudRate_500=\nLSS_Supported=").replace("=Position value", "=")
    found = sheet(text=text).find(0x6004, 0)
    assert found is not None
    assert found.name == "6004"


def test_booleans_one_by_one_and_as_bytes() -> None:
    booleans = "".join(entry(f"210{n}", 1, DefaultValue=n % 2, AccessType="ro") for n in range(3))
    mapping = FILE.replace("=0x60040020", "=0x21000001").replace(
        "SubNumber=2\n[1A00sub0]", "SubNumber=3\n[1A00sub0]"
    )
    text = mapping.replace(
        "Number\nDataType=0x0005\nAccessType=rw\nDefaultValue=1",
        "Number\nDataType=0x0005\nAccessType=rw\nDefaultValue=2",
    )
    read = sheet(booleans, entry("1A00sub2", 7, DefaultValue="0x21010008"), text=text)
    (pdo,) = read.pdos()
    assert pdo.objects == (
        PdoObject(0x2100, 0, 1, CanType.BOOLEAN),
        PdoObject(0x2101, 0, 8, CanType.BOOLEAN),
    )
    assert [read.number(0x2100 + n, 0) for n in range(3)] == [0, 1, 0]


def test_boolean_in_words_is_no_number() -> None:
    read = sheet(entry("2100", 1, DefaultValue="TRUE"))
    assert read.number(0x2100, 0) is None
    assert read.find(0x2100, 0) is not None


def test_modular_device() -> None:
    """CiA 306: modules' objects are described beside the device's own, and are not the device's."""
    modules = """\
[SupportedModules]
NrOfEntries=1
[M1ModuleInfo]
ProductName=8 inputs
ProductVersion=1
ProductRevision=1
OrderCode=X
[M1FixedObjects]
NrOfEntries=0
[M1SubExtends]
NrOfEntries=1
1=0x6000
[M1SubExt6000]
ParameterName=Inputs
ObjectType=0x7
DataType=0x0005
AccessType=ro
PDOMapping=1
Count=1
ObjExtend=0
"""
    read = sheet(modules)
    assert read.find(0x6000, 1) is None
    assert read.find(0x6004, 0) is not None


@pytest.mark.parametrize(
    "kind, text, number",
    [
        (0x03, "-5", -5),
        (0x03, "0x-5", -5),
        (0x03, "0xFFFB", -5),
        (0x10, "0xFFFFFB", -5),
        (0x06, "0xFFFB", 0xFFFB),
        (0x07, "$NODEID+0x180", 0x185),
        (0x07, "0x180 + $NODEID", 0x185),
        (0x07, "$NodeID", 5),
        (0x07, "0x80000000+$NODEID+0x180", 0x8000_0185),
        (0x05, "007", 7),
        (0x05, "seven", None),
    ],
)
def test_numbers(kind: int, text: str, number: int | None) -> None:
    assert sheet(entry("2000", kind, DefaultValue=text)).number(0x2000, 0) == number


def test_array_in_one_piece_has_as_many_members_as_it_says() -> None:
    read = sheet(entry("6000", 5, ObjectType="0x8", CompactSubObj=3, AccessType="ro", DefaultValue=9))
    names = [(found.index, found.subindex) for found in read.objects() if found.index == 0x6000]
    assert names == [(0x6000, 0), (0x6000, 1), (0x6000, 2), (0x6000, 3)]
    assert read.find(0x6000, 4) is None
    third = read.find(0x6000, 3)
    assert third is not None
    assert (third.type, third.bits, third.subindex) == (CanType.UNSIGNED8, 8, 3)


def test_incomplete_dummy_usage_and_comments() -> None:
    assert sheet("[DummyUsage]\nDummy0001=0\n[Comments]\nLine1=hello\n").find(0x6004, 0) is not None


def test_text_of_an_old_tool_of_windows() -> None:
    text = FILE.replace("Position value", "Zähler; Übersetzung").replace("\n", "\r\n")
    found = DataSheet(text.encode("cp1252"), NODE).find(0x6004, 0)
    assert found is not None
    assert found.name == "Zähler; Übersetzung"


def test_switched_off_and_empty_pdos_are_none() -> None:
    assert sheet(text=FILE.replace("0x40000180", "0xC0000180")).pdos() == ()
    assert sheet(text=FILE.replace("DefaultValue=0x60040020", "DefaultValue=0")).pdos() == ()


def test_product_code_that_only_tools_know_is_not_asked_for() -> None:
    assert sheet(text=FILE.replace("[1018sub2]", "[2222]")).identity.product is None


def test_layout_that_cannot_be_written() -> None:
    assert sheet(
        text=FILE.replace("Number\nDataType=0x0005\nAccessType=rw", "Number\nDataType=0x0005\nAccessType=ro")
    ).is_fixed(1, transmit=True)


def test_zero_says_nothing_of_the_identity() -> None:
    text = FILE.replace("=0x1F0", "=0").replace("=0x401", "=0").replace("=0x00020196", "=0")
    assert sheet(text=text).identity == ExpectedIdentity()


def test_dcf_has_settings_and_pdos_of_its_own() -> None:
    text = FILE.replace("DefaultValue=254", "DefaultValue=254\nParameterValue=1").replace(
        "DefaultValue=$NODEID+0x40000180", "DefaultValue=$NODEID+0x40000180\nParameterValue=0x285"
    )
    read = sheet(
        entry("2000", 3, ParameterValue="-2"),
        entry("2001", 8, ParameterValue="1.5"),
        entry("2002", 9, ParameterValue="abc"),
        entry("2003", 0x0F, ParameterValue="0a0b"),
        entry("2004", 0x16, ParameterValue="0x010203"),
        entry("2005", 5, ParameterValue="3", DefaultValue="3"),
        entry("2006", 5, ParameterValue="3", AccessType="ro"),
        entry("1017", 6, ParameterValue="100"),
        text=text,
    )
    assert read.settings() == (
        Setting(0x2000, 0, b"\xfe\xff"),
        Setting(0x2001, 0, b"\0\0\xc0\x3f"),
        Setting(0x2002, 0, b"abc"),
        Setting(0x2003, 0, b"\x0a\x0b"),
        Setting(0x2004, 0, b"\3\2\1"),
    )
    (pdo,) = read.pdos()
    assert (pdo.cob_id, pdo.transmission, pdo.no_remote) == (0x285, 1, False)


@pytest.mark.parametrize("kind, value", [(5, "300"), (5, "x"), (0x0F, "xy"), (8, "x"), (0x0C, "1")])
def test_value_that_its_type_cannot_have(kind: int, value: str) -> None:
    read = sheet(entry("2000", kind, ParameterValue=value))
    with pytest.raises(DataSheetError, match=r"2000h:00 Object 2000: '.*' is no value of its type"):
        read.settings()


@pytest.mark.parametrize(
    "text, reason",
    [
        ("hello", "no section headers"),
        ("[2000]\nObjectType=7\n", "No option 'ParameterName'"),
        (FILE + "[6004]\n", "already exists"),
        ("[2000sub1]\nParameterName=x\nDataType=5\nAccessType=ro\n", "2000"),
    ],
)
def test_what_is_no_data_sheet(text: str, reason: str) -> None:
    with pytest.raises(DataSheetError, match="this is no data sheet that can be read: .*" + reason):
        sheet(text=text)


@given(st.binary(max_size=200))
def test_hostile_files(data: bytes) -> None:
    try:
        read = DataSheet(data + b"\n" + FILE.encode(), NODE)
        list(read.objects())
        read.pdos()
        read.settings()
    except DataSheetError as error:
        assert "\n" not in str(error)  # noqa: PT017 - either is good
