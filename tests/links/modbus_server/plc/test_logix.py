"""Files for Studio 5000: well-formed, with the hidden numbers of truths, and the escapes of the table of tags."""

from __future__ import annotations

from collections import Counter
from xml.etree import ElementTree as ET

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.logix.code import pack, unpack
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.plc.logix.l5x import LogixMember, data_type
from gatewayd.plc.logix.tags_csv import tags
from tests.links.modbus_server.plc.cells import model
from tests.plc_golden import golden_model


def parsed(text: str) -> ET.Element:
    return ET.fromstring(text)  # noqa: S314 - a file of ours


def test_every_file_names_its_one_target() -> None:
    for file in files_for("studio5000", golden_model()):
        if file.name.endswith(".L5X"):
            root = parsed(file.text)
            targets = [element for element in root.iter() if element.get("Use") == "Target"]
            assert [element.get("Name") for element in targets] == [root.get("TargetName")], file.name


def test_truths_are_bits_of_hidden_numbers() -> None:
    members = [LogixMember(f"b{number}", "BOOL") for number in range(10)]
    root = parsed(data_type("T", "", [*members, LogixMember("many", "BOOL", 33)]))
    found = {member.get("Name"): member for member in root.iter("Member")}
    hosts = Counter(member.get("Target") for member in found.values() if member.get("DataType") == "BIT")
    assert hosts == {"ZZZZZZZZZZT0": 8, "ZZZZZZZZZZT1": 2}
    assert {found[str(host)].get("Hidden") for host in hosts} == {"true"}
    assert found["many"].get("Dimension") == "64"


def test_the_table_of_tags_has_its_escapes() -> None:
    text = tags(("a",), [LogixMember("A", "INT", 3, 'say "ä" for $1')])
    assert text.splitlines()[0] == 'remark,"CSV-Import-Export"'
    assert text.splitlines()[-1].startswith('TAG,,A,"say $Q$00E4$Q for $$1","INT[3]","",')
    assert '"$D83D$DE00"' in tags((), [LogixMember("A", "INT", 3, "\U0001f600")])


@pytest.mark.parametrize(
    "order, first, second",
    [
        ("ABCD", "GW_Words[0] := GW_Image.read1[1];", "GW_Words[1] := GW_Image.read1[0];"),
        ("CDAB", "GW_Words[0] := GW_Image.read1[0];", "GW_Words[1] := GW_Image.read1[1];"),
        (
            "BADC",
            "SWPB(GW_Image.read1[1], REVERSE, GW_Words[0]);",
            "SWPB(GW_Image.read1[0], REVERSE, GW_Words[1]);",
        ),
        (
            "DCBA",
            "SWPB(GW_Image.read1[0], REVERSE, GW_Words[0]);",
            "SWPB(GW_Image.read1[1], REVERSE, GW_Words[1]);",
        ),
    ],
)
def test_word_orders(order: str, first: str, second: str) -> None:
    """The controller has the least significant word first in memory."""
    found = model(f"a: {{robot: output_int_register_0, modbus: {{holding: 9, type: int32, order: {order}}}}}")
    lines = [line.strip() for line in unpack(found)]
    assert lines[1:4] == [first, second, "COP(GW_Words[0], GW_Outputs.a, 1);"]


def test_what_is_beyond_the_register_is_told() -> None:
    found = model(
        "a: {robot: input_double_register_0, modbus: {holding: 9, type: int16, scale: 0.1}, owner: plc}"
    )
    lines = list(pack(found))
    assert "IF GW_REAL_Value > 32767.0 THEN GW_REAL_Value := 32767.0; GW_Clipped := 1; END_IF;" in lines


def test_older_controllers_have_signed_numbers_only() -> None:
    found = model("a: {robot: output_int_register_0, modbus: {holding: 9, type: uint16}}")
    with pytest.raises(ExportError, match=r"`a` is UINT, which controllers older than the 5380 and 5580"):
        files_for("studio5000", found, small=True)
