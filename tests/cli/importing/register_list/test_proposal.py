"""Lists that people have, as mappings: whole or not at all."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mapping.diagnostics import Severity
from gatewayd.mapping.loader import load
from tests.cli.importing.register_list.lists import ENGLISH, GERMAN, doubts, errors, lines, made


def test_an_english_list() -> None:
    found = made(ENGLISH)
    assert lines(found) == {
        "start": '{robot: input_bit_register_0, modbus: 0.0, owner: plc, comment: "begin one cycle"}',
        "part": "{robot: input_int_register_0, modbus: {holding: 10, type: uint16}, owner: plc, "
        'comment: "1, 2 or 3"}',
        "force": "{robot: input_double_register_0, modbus: {holding: 20, type: int16, scale: 0.1}, "
        "owner: plc, unit: N}",
        "cycles": "{robot: output_int_register_0, modbus: {holding: 100, type: int32}}",
        "ready": "{robot: output_bit_register_0, modbus: {discrete: 0}}",
    }
    assert errors(found) == []


def test_a_german_list_with_semicolons_and_decimal_commas() -> None:
    found = made(GERMAN, "from-0")
    assert lines(found)["Greifkraft"] == (
        "{robot: input_double_register_0, modbus: {holding: 20, type: int16, scale: 0.1}, owner: plc, "
        "limits: [0, 150], unit: N}"
    )
    assert list(lines(found)) == ["Zyklus_starten", "Greifkraft", "Zaehler"]
    assert (2, 3, "`Zyklus starten` is called `Zyklus_starten`") in doubts(found)
    assert (4, 3, "`Zähler` is called `Zaehler`") in doubts(found)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings_that_spreadsheets_write(encoding: str) -> None:
    found = made(GERMAN.encode(encoding), "from-0")
    assert 'unit: "Stück"' in lines(found)["Zaehler"]
    assert any("Windows-1252" in text for *_, text in doubts(found)) == (encoding == "cp1252")


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_delimiters(delimiter: str) -> None:
    text = "name,address,type,access\nspeed,10,uint16,W\n".replace(",", delimiter)
    assert list(lines(made(text, "from-0"))) == ["speed"]


HEAD = "name,address,type,access,scale,bit,length,order,min,max,robot,area,function\n"


@pytest.mark.parametrize(
    "row, message",
    [
        (",1,int16,R", "no name"),
        ("a,,int16,R", "no address"),
        ("a,x,int16,R", "`x` cannot be read here"),
        ("a,70000,int16,R", "`70000` cannot be read here"),
        ("a,1,int17,R", "`int17` cannot be read here"),
        ("a,1,int16,maybe", "`maybe` is no access"),
        ("a,1,int16,", "not said whether the PLC writes or reads it"),
        ('a,1,int16,R,"0,1"', "`0,1` cannot be read here"),
        ("a,1,int16,R,1.000.0", "`1.000.0` cannot be read here"),
        ("a,1,int16,R,,17", "a register has no bit 17"),
        ("a,1,int32,R,,,1", "int32 has 2 registers, the list says 1"),
        ("a,1,int32,R,,,,middle", "`middle` cannot be read here"),
        ("a,1,int16,R,,,,,5", "one limit only"),
        ("a,1,int16,W,,,,,,,input_int_register_99", "GW304"),
        ("a,1,int16,W,,,,,,,,input", "nobody writes into the area input"),
        ("a,400001,int16,W,,,,,,,,coil", "the area is coil here, and holding elsewhere"),
        ("a,1,int16,R,,,,,,,,,FC99", "`FC99` cannot be read here"),
        ("???,1,int16,R", "`???` is no name"),
        ("a,1,int16,R\na,2,int16,R\nb,3,int16,R\na,4,int16,R", "`a` is in line 2 already"),
        ("a,1,int32,R\nb,2,int16,R", "GW214"),
        ("a[1],1,int16,R", "`a[1]` where `a[0]` would follow"),
        ("a[0],1,int16,R\na[1],3,int16,R", "address 3 of the list became 2"),
        ("a,60001,int16,R", "GW203"),
        ("a,40011,int16,R", "GW204"),
        ("a,1,int16,R,,,,,,,,,,x", "more cells than columns"),
    ],
)
def test_an_error_is_at_its_cell_and_nothing_is_written(row: str, message: str) -> None:
    found = made(HEAD + row + "\n", "from-0")
    assert found.text is None
    assert any(message in text for *_, text in errors(found)), found.findings
    assert all(line > 1 for line, _, _ in errors(found))


def test_columns_are_those_of_the_file() -> None:
    found = made('name;address;type;access\n"speed; high";x;int16;R\n')
    assert [(line, column) for line, column, text in errors(found) if "`x`" in text] == [(2, 15)]


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "no head line"),
        ("name,address,type,access\n", "no row below the head line"),
        ("foo,bar\n1,2\n", "no head line"),
        ("address,type,access\n1,int16,R\n", "no column for the name"),
        ("name,address,address,access\na,1,2,R\n", "two columns for the address"),
        ("name,address,access\na,1,W\n\x00", "a control character"),
        (
            "name,address,type,access\n" + "".join(f"a{n},{n},int16,R\n" for n in range(5001)),
            "more than 5000 rows",
        ),
        (
            "name,address,type,access\n" + "".join(f"a{n},{n},int16,R\n" for n in range(25)),
            "no output_int_register after 23",
        ),
        ("name,address,type,access,object\na,1,int16,R,2000h:01\n", "CANopen objects are not imported"),
    ],
)
def test_what_is_no_list_is_refused(text: str, message: str) -> None:
    found = made(text, "from-0")
    assert found.text is None
    assert any(message in error for *_, error in errors(found)), found.findings


@pytest.mark.parametrize(
    "row, counting, address",
    [
        ("a,0x0A,int16,R", "", 10),
        ("a,0Ah,int16,R", "", 10),
        ("a,16#0A,int16,R", "", 10),
        ("a,%MW10,int16,R", "from-0", 10),
        ("a,400011,int16,R", "", 10),
        ("a,10,int16,R", "from-0", 10),
        ("a,11,int16,R", "from-1", 10),
        ("a,40011,int16,R", "", 10),
        ("a,40011,int16,R", "traditional", 10),
        ("a,400011,int16,R", "from-1", 10),
    ],
)
def test_forms_of_addresses(row: str, counting: str, address: int) -> None:
    found = made(f"name,address,type,access\n{row}\n", counting)
    assert f"{{holding: {address}, type: int16" in lines(found)["a"]


def test_what_may_be_meant_otherwise_is_a_doubt_said_once() -> None:
    text = (
        "name,address,type,access,min,max,Zone\na,10,INT,R,0,1,x\nb,11,INT,R,0,1,y\nc,40012,FLOAT,R,0,1,z\n"
    )
    found = made(text)
    assert [(line, column, text) for line, column, text in doubts(found) if "GW" not in text] == [
        (1, 34, "the column `Zone` is not used"),
        (2, 1, "the list names no field of the robot: the next free register is proposed (and 2 more)"),
        (2, 3, "addresses are taken as counted from 0 (and 1 more)"),
        (2, 6, "`INT` is taken as int16, as in IEC 61131-3 (and 1 more)"),
        (2, 12, "limits are taken as of the value, not of the raw number (and 2 more)"),
        (4, 3, "five digits are taken as an address with the area before it: 40001 is holding register 0"),
        (4, 9, "`FLOAT` is taken as float32, as in IEC 61131-3"),
        (4, 9, "no byte order is said: ABCD is taken, the high word first"),
    ]


def test_an_address_0_says_how_the_list_counts() -> None:
    found = made("name,address,type,access\na,0,int16,R\nb,1,int16,R\n")
    assert not any("counted from" in text for *_, text in doubts(found))


def test_a_list_of_inputs_needs_the_address_of_its_writer() -> None:
    text = "name,address,type,access,owner\na,1,int16,W,hmi\n"
    assert errors(made(text, "from-0")) == [(2, 13, "the address of the writer `hmi` is not known")]
    assert "hmi: {modbus: 127.0.0.7" in (made(text, "from-0", writers={"hmi": "127.0.0.7"}).text or "")
    alone = "name,address,type,access\na,1,int16,W\n"
    assert (
        errors(made(alone, "from-0", writers={}))[0][2] == "the PLC writes this, and its address is not known"
    )


def test_every_writer_without_an_address_is_named() -> None:
    text = "name,address,type,access,owner\na,1,int16,W,hmi\nb,2,int16,W,panel > line\n"
    assert errors(made(text, "from-0")) == [
        (2, 13, "the address of the writer `hmi` is not known"),
        (3, 13, "the address of the writer `line` is not known"),
        (3, 13, "the address of the writer `panel` is not known"),
    ]


@pytest.mark.parametrize(
    "head, row, doubt",
    [
        ("type", "int32", "no byte order is said: ABCD is taken, the high word first"),
        ("type,order", "int32,CDAB", None),
        ("type", "int16", None),
        ("length", "1", "no type is said: int16 is taken"),
        ("length,order", "2,CDAB", "no type is said: int32 is taken"),
        ("comment", "x", "no type is said: the usual one of the robot's field is taken"),
    ],
)
def test_what_the_list_does_not_say_of_a_number_is_a_doubt(head: str, row: str, doubt: str | None) -> None:
    found = made(f"name,address,access,robot,{head}\na,1,R,output_int_register_0,{row}\n", "from-0")
    assert found.text is not None
    assert [text for *_, text in doubts(found) if "GW703" not in text] == ([doubt] if doubt else [])


def test_one_name_at_two_registers_is_a_doubt_unless_the_robots_field_is_said() -> None:
    text = "name,address,type,access\na,1,int16,R\na,2,int16,R\n"
    assert (3, 1, "`a` is in line 2 already: one value at two addresses") in doubts(made(text, "from-0"))
    said = "name,address,type,access,robot\na,1,int16,R,runtime_state\na,2,int16,R,runtime_state\n"
    assert not any("already" in text for *_, text in doubts(made(said, "from-0")))


def test_a_row_with_an_object_alone_says_that_the_row_has_to_go() -> None:
    text = "name,address,type,access,object\na,,int16,R,2000h:01\nb,1,int16,R,2000h:02\n"
    found = made(text, "from-0")
    hints = [finding.hint for finding in found.findings if "CANopen" in finding.text]
    assert hints == ["delete the row: it has no register", "delete the columns for CANopen"]


def test_of_very_many_errors_the_first_are_listed() -> None:
    found = made("name,address,type,access\n" + "?,x,y,z\n" * 5000)
    assert found.text is None
    assert len(errors(found)) == 201
    assert errors(found)[-1][2] == "and 19800 more"


def test_a_list_of_doubts_is_short() -> None:
    """Names that had to change are one doubt each, up to what a mapping can hold; the others are said once."""
    rows = "".join(f"value {number},{number},int16,R\n" for number in range(24))
    assert (
        len(
            [
                text
                for *_, text in doubts(made("name,address,type,access\n" + rows, "from-0"))
                if "GW" not in text
            ]
        )
        == 25
    )


NASTY = st.text(st.sampled_from(",;\t|\"\n\r0123456789.xhMW%[]{}:#'- aäRW"), max_size=40)
CELLS = st.one_of(
    NASTY,
    st.sampled_from(
        ["a", "a[0]", "b", "0", "1", "40001", "0x10", "int16", "bit", "real", "R", "W", "0.5", "-1", "3"]
    ),
)


@given(rows=st.lists(st.lists(CELLS, max_size=14), max_size=6))
def test_whatever_the_cells_are_the_result_passes_the_check_or_there_is_none(rows: list[list[str]]) -> None:
    """And what is written has no more than the list has: no cell becomes a key of the mapping."""
    text = HEAD + "\n".join(",".join('"' + cell.replace('"', '""') + '"' for cell in row) for row in rows)
    found = made(text, "from-0")
    if found.text is None:
        assert errors(found)
        return
    loaded = load(found.text.encode(), "made.yaml")
    assert loaded.plan is not None
    assert all(finding.rule.severity is Severity.WARNING for finding in loaded.diagnostics)
    assert loaded.plan.cell.name == "press"
    assert 0 < len(loaded.plan.cell.variables) <= len(rows)


@given(content=st.binary(max_size=300))
def test_no_bytes_do_harm(content: bytes) -> None:
    assert made(content).text is None


@given(text=st.text(max_size=60))
def test_any_text_stays_a_text(text: str) -> None:
    """Comments and units with quotation marks, colons, braces and line ends."""
    cell = '"' + text.replace('"', '""') + '"'
    found = made(f"name,address,type,access,comment\na,1,int16,R,{cell}\n", "from-0")
    if found.text is not None:
        loaded = load(found.text.encode(), "made.yaml")
        assert loaded.plan is not None
        assert loaded.plan.cell.variables[0].comment == " ".join(text.split())


def test_what_every_row_lacks_is_said_once_with_its_lines() -> None:
    text = "name,address,type\n" + "".join(f"a{number},{number},int16\n" for number in range(14))
    (found,) = made(text, "from-0").findings
    assert found.text == (
        "not said whether the PLC writes or reads it (14 rows: lines 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 4 more)"
    )
    assert (found.place, found.hint) == ((2, 1), "add a column `access`: R, W or RW")


@pytest.mark.parametrize("cell", ["0..100", "0-100", "[0;100]", "0/100", "0 to 100", "0 bis 100"])
def test_both_limits_in_one_cell(cell: str) -> None:
    found = made(f"name,address,type,access,range\nspeed,10,uint16,W,{cell}\n", "from-0")
    assert "limits: [0, 100]" in lines(found)["speed"]


def test_what_the_robot_has_no_registers_for_is_one_error() -> None:
    rows = "".join(f"v{number},{number},int16,R\n" for number in range(60))
    (finding,) = errors(made(f"name,address,type,access\n{rows}", "from-0"))
    assert finding[-1].startswith("the robot has no output_int_register after 23 (36 rows: lines 26, 27, ")


def test_limits_twice_are_an_error() -> None:
    found = made("name,address,type,access,limits,min,max\nspeed,10,uint16,W,0..5,0,5\n", "from-0")
    assert [text for *_, text in errors(found)] == ["limits here, and in a column of their own"]


@pytest.mark.parametrize(
    "address, place, doubt",
    [
        ("%MX10.3", "10.3", "%MXn.b is taken as bit b of %MWn"),
        (
            "%MD5",
            "{holding: 10, type: int32, order: ABCD}",
            "%MDn is taken as the double word that begins at %MW(2n)",
        ),
        ("%QW7", "{holding: 7, type: int32, order: ABCD}", "%QW are outputs of the PLC"),
        ("%IW7", "{holding: 7, type: int32, order: ABCD}", "%IW are inputs of the PLC"),
    ],
)
def test_located_variables_of_the_standard(address: str, place: str, doubt: str) -> None:
    """What their numbers count differs from tool to tool: each kind is a doubt."""
    kind = "bit" if "MX" in address else "int32"
    access = "" if address[1] in "QI" else "R"
    found = made(f"name,address,type,access,order\na,{address},{kind},{access},ABCD\n", "from-0")
    assert f"modbus: {place}" in lines(found)["a"]
    assert any(doubt in text for *_, text in doubts(found))
    side = "input" if address.startswith("%QW") else "output"
    assert f"robot: {side}_" in lines(found)["a"]
