"""A mapping proposed from a data sheet: registers by type, what is left out, and that the result passes the check."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.devices.canopen.proposal import SHEETS
from gatewayd.links.proposals import RemarkKind, SheetProposal, SheetSettings
from gatewayd.mapping.loader import load
from tests.links.devices.canopen.cells import SHEET
from tests.links.devices.canopen.sheets import Described, eds

BOOLEAN, INTEGER16, UNSIGNED8, UNSIGNED32, REAL32, STRING, UNSIGNED24, INTEGER64 = (
    1,
    3,
    5,
    7,
    8,
    9,
    0x16,
    0x15,
)


def propose(data: bytes, path: str = "drive.eds") -> SheetProposal:
    return SHEETS.propose(data, SheetSettings("press", "127.0.0.1", "drive", "can1", 5, path))


def variables(found: SheetProposal) -> dict[str, str]:
    lines = found.text.partition("variables:\n")[2].partition("\n\n")[0].splitlines()
    return {name: rest for name, _, rest in (line.strip().partition(": ") for line in lines)}


def said(found: SheetProposal, kind: RemarkKind) -> list[str]:
    return [f"{remark.line}: {remark.text}" for remark in found.remarks if remark.kind is kind]


def findings(found: SheetProposal, data: bytes, folder: Path) -> Sequence[str]:
    (folder / "drive.eds").write_bytes(data)
    return [each.message for each in load(found.text.encode(), str(folder / "press.yaml")).diagnostics]


def test_registers_follow_from_types_in_the_order_of_the_pdos(tmp_path: Path) -> None:
    objects = {
        0x2001: Described(BOOLEAN, name="Door"),
        0x2002: Described(BOOLEAN, name="Part present"),
        0x2003: Described(INTEGER16, name="Torque"),
        0x2004: Described(UNSIGNED32, name="Position"),
        0x2005: Described(REAL32, name="Force"),
        0x2006: Described(UNSIGNED8, "rw", "Lamp"),
        0x2007: Described(INTEGER16, "rww", "Speed"),
    }
    data = eds(
        objects,
        [[0x20010001, 0x20020001, 0x20030010], [0x20040020, 0x20050020]],
        [[0x20060008, 0x20070010]],
    )
    found = propose(data)
    lines = variables(found)
    assert {name: line.partition(",")[0] for name, line in lines.items()} == {
        "door": "{robot: input_bit_register_0",
        "part_present": "{robot: input_bit_register_1",
        "torque": "{robot: input_int_register_0",
        "position": "{robot: input_double_register_0",
        "force": "{robot: input_double_register_1",
        "lamp": "{robot: output_int_register_0",
        "speed": "{robot: output_int_register_1",
    }
    assert "limits: [0, 255]" in lines["lamp"]
    assert "limits: [-32768, 32767]" in lines["speed"]
    assert "owner: drive" in lines["door"]
    assert found.variables == 7
    assert said(found, RemarkKind.ERROR) == []
    assert [text.partition(": ")[2].partition(",")[0][:25] for text in said(found, RemarkKind.DOUBT)] == [
        "the device has no heartbe",
        "whether the device takes ",
    ]
    assert findings(found, data, tmp_path) == []


def test_sheet_of_the_rules_passes_the_check(tmp_path: Path) -> None:
    data = SHEET.read_bytes()
    found = propose(data)
    assert list(variables(found)) == ["position_value", "outputs_1_to_8"]
    assert "#   6010h:00 bit, from the device: Limit switch" in found.text
    assert findings(found, data, tmp_path) == []


def test_what_no_variable_can_have_is_an_error_with_its_line() -> None:
    objects = {
        0x2001: Described(UNSIGNED24, name="Odd"),
        0x2002: Described(STRING, name="Text"),
        0x2003: Described(7),
    }
    data = eds(
        objects,
        [[0x20010018], [0x20020020], [0x20030010], [0x20990008], [0x20030020, 0x20030020, 0x20030020]],
    )
    found = propose(data)
    text = data.decode().splitlines()
    errors = said(found, RemarkKind.ERROR)
    assert [each.partition(": ")[2] for each in errors] == [
        "no PDO of the data sheet has an object that can become a variable",
        "2001h:00 Odd in TPDO 1 is of the type 0016h, which no variable can have",
        "2002h:00 Text in TPDO 2 is of the type 0009h, which no variable can have",
        "2003h:00 has 32 bits, and 16 bits in TPDO 3",
        "TPDO 4 has 2099h:00, which the data sheet does not describe",
        "TPDO 5 has 96 bits, which no CAN frame carries",
    ]
    lines = {each.partition(": ")[2][:8]: int(each.partition(": ")[0]) for each in errors}
    assert text[lines["2001h:00"] - 1] == "[2001]"
    assert text[lines["TPDO 4 h"] - 1] == "[1A03]"


def test_read_only_object_in_a_pdo_to_the_device() -> None:
    found = propose(eds({0x2001: Described(UNSIGNED8, "ro", "Stuck")}, (), [[0x20010008]]))
    assert "cannot be written" in said(found, RemarkKind.ERROR)[-1]
    assert (found.text, found.variables) == ("", 0)


def test_gaps_and_objects_in_two_pdos_are_notes() -> None:
    data = eds({0x2001: Described(UNSIGNED8)}, [[0x00050008, 0x20010008], [0x20010008]])
    found = propose(data)
    assert [text.partition(": ")[2] for text in said(found, RemarkKind.NOTE)] == [
        "TPDO 1 has a gap of 8 bits",
        "2001h:00 is in TPDO 2 too; the first PDO is used",
    ]
    assert list(variables(found)) == ["value"]


def test_64_bits_are_a_doubt() -> None:
    found = propose(eds({0x2001: Described(INTEGER64)}, [[0x20010040]]))
    assert any("up to 2^53" in text for text in said(found, RemarkKind.DOUBT))
    assert "input_double_register_0" in variables(found)["value"]


def test_names_are_unique_and_names() -> None:
    objects = {
        0x2001: Described(UNSIGNED8, name="Wert"),
        0x2002: Described(UNSIGNED8, name="Wert"),
        0x2003: Described(UNSIGNED8, name="8 bits"),
        0x2004: Described(UNSIGNED8, name="x" * 200),
        0x2005: Described(UNSIGNED8, "rw", "Both"),
    }
    data = eds(objects, [[index << 16 | 8 for index in objects]], [[0x20050008]])
    assert list(variables(propose(data))) == [
        "wert",
        "object_2002_00",
        "object_2003_00",
        "x" * 56,
        "both",
        "object_2005_00",
    ]


def test_registers_run_out() -> None:
    objects = {0x2000 + number: Described(UNSIGNED8, name=f"n{number}") for number in range(26)}
    pdos = [[index << 16 | 8 for index in list(objects)[first : first + 8]] for first in range(0, 26, 8)]
    found = propose(eds(objects, pdos))
    assert len(variables(found)) == 24
    assert sum("no input_int_register after 23" in text for text in said(found, RemarkKind.ERROR)) == 2


@pytest.mark.parametrize("data", [b"", b"\0\xff" * 100, b"[1000", b"not a data sheet"])
def test_what_is_no_data_sheet(data: bytes) -> None:
    found = propose(data)
    assert found.text == ""
    assert said(found, RemarkKind.ERROR)


@given(st.integers(0, 3000), st.binary(max_size=40))
def test_never_raises(at: int, noise: bytes) -> None:
    data = SHEET.read_bytes()
    propose(data[:at] + noise + data[at + len(noise) :])


def test_path_is_quoted() -> None:
    found = propose(SHEET.read_bytes(), f"..{os.sep}my sheet: 1.eds")
    assert 'eds: "../my sheet: 1.eds"' in found.text
