"""PLCopen XML (TC6 2.01): data types and blocks as the engineering tools exchange them.

The layout is that of public generators whose files CODESYS imports: global variables lie in the project's own
`addData`, because a list in a configuration is not taken; identifiers of objects are left for the tool to give.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from gatewayd.plc.st.program import (
    DataType,
    Enumeration,
    PlcVariable,
    ProgramUnit,
    Structure,
    TypeName,
)

_NAMESPACE: Final = "http://www.plcopen.org/xml/tc6_0201"
_XHTML: Final = "http://www.w3.org/1999/xhtml"
_GLOBALS: Final = "http://www.3s-software.com/plcopenxml/globalvars"
_NEVER: Final = "2026-01-01T00:00:00"
"""The schema asks for a time; one that is always the same keeps the file the same."""
_LISTS: Final = {
    "VAR_INPUT": "inputVars",
    "VAR_OUTPUT": "outputVars",
    "VAR_IN_OUT": "inOutVars",
    "VAR": "localVars",
}
_BLOCKS: Final = frozenset({"TON"})
"""Of the standard library: what is no elementary type."""
_KINDS: Final = {"FUNCTION": "function", "FUNCTION_BLOCK": "functionBlock", "PROGRAM": "program"}


def project(
    name: str,
    header: Sequence[str],
    types: Iterable[DataType],
    units: Iterable[ProgramUnit],
    variables: tuple[str, tuple[PlcVariable, ...]] | None = None,
) -> str:
    """A file. `variables`: name of a list of global variables, and these."""
    root = Element("project", {"xmlns": _NAMESPACE})
    SubElement(
        root,
        "fileHeader",
        {"companyName": "", "productName": "gatewayd", "productVersion": "1", "creationDateTime": _NEVER},
    )
    content = SubElement(root, "contentHeader", {"name": name})
    SubElement(content, "Comment").text = "\n".join(header)
    coordinates = SubElement(content, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        SubElement(SubElement(coordinates, language), "scaling", {"x": "1", "y": "1"})
    parts = SubElement(root, "types")
    data_types, pous = SubElement(parts, "dataTypes"), SubElement(parts, "pous")
    for kind in types:
        _data_type(data_types, kind)
    for unit in units:
        _pou(pous, unit)
    SubElement(SubElement(root, "instances"), "configurations")
    if variables is not None:
        data = SubElement(_added(root), "data", {"name": _GLOBALS, "handleUnknown": "implementation"})
        _variables(SubElement(data, "globalVars", {"name": variables[0]}), variables[1])
    indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{tostring(root, encoding="unicode")}\n'


def _added(parent: Element) -> Element:
    return SubElement(parent, "addData")


def _data_type(parent: Element, kind: DataType) -> None:
    element = SubElement(parent, "dataType", {"name": kind.name})
    base = SubElement(element, "baseType")
    if isinstance(kind, Enumeration):
        values = SubElement(SubElement(base, "enum"), "values")
        for number, (name, _meaning) in enumerate(kind.literals):
            SubElement(values, "value", {"name": name, "value": str(number)})
        return
    assert isinstance(kind, Structure)
    _variables(SubElement(base, "struct"), kind.fields)
    _documentation(element, kind.comment)


def _pou(parent: Element, unit: ProgramUnit) -> None:
    pou = SubElement(parent, "pou", {"name": unit.name, "pouType": _KINDS[unit.keyword]})
    interface = SubElement(pou, "interface")
    if unit.result:
        SubElement(SubElement(interface, "returnType"), unit.result)
    for section in unit.sections:
        if section.fields:
            _variables(SubElement(interface, _LISTS[section.keyword]), section.fields)
    _documentation(interface, unit.comment)
    text = SubElement(SubElement(SubElement(pou, "body"), "ST"), "xhtml", {"xmlns": _XHTML})
    text.text = "\n".join(unit.body)


def _variables(parent: Element, fields: Iterable[PlcVariable]) -> None:
    for field in fields:
        variable = SubElement(parent, "variable", {"name": field.name})
        _type(SubElement(variable, "type"), field.type)
        if field.initial:
            SubElement(SubElement(variable, "initialValue"), "simpleValue", {"value": field.initial})
        _documentation(variable, field.comment)


def _type(parent: Element, name: TypeName) -> None:
    if name.last is not None:
        array = SubElement(parent, "array")
        SubElement(array, "dimension", {"lower": str(name.first), "upper": str(name.last)})
        parent = SubElement(array, "baseType")
    if name.is_pointer:
        parent = SubElement(SubElement(parent, "pointer"), "baseType")
    if name.is_own or name.name in _BLOCKS:
        SubElement(parent, "derived", {"name": name.name})
    else:
        SubElement(parent, "string" if name.name == "STRING" else name.name)


def _documentation(parent: Element, text: str) -> None:
    if text:
        SubElement(SubElement(parent, "documentation"), "xhtml", {"xmlns": _XHTML}).text = text
