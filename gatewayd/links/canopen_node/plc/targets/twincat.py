"""TwinCAT 3: one file for each object of the project, and a table of the box's variables to be linked.

The CANopen masters (EL6751, FC51xx) show each object of a PDO as an input or output of the node's box. The list of
variables declares the two sides with `AT %I*` and `AT %Q*`: TwinCAT makes inputs and outputs of the PLC of them, to
which those of the box are linked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from gatewayd.links.canopen_node.plc.blocks import blocks, data_types, main
from gatewayd.links.canopen_node.plc.content import Objects
from gatewayd.links.canopen_node.plc.data import data
from gatewayd.links.canopen_node.plc.model import PdoImage, PdoModel, PdoTag, PdoWord
from gatewayd.links.canopen_node.plc.pdo_text import object_table, pdo_lines
from gatewayd.links.exports import ExportedFile
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import CODESYS
from gatewayd.plc.names import Holds
from gatewayd.plc.st.cast import POINTER
from gatewayd.plc.st.dialect import Dialect
from gatewayd.plc.st.program import VariableSection
from gatewayd.plc.st.source import data_type_source, section_source
from gatewayd.plc.st.tree import lines_with, object_text, unit_file

HOLDS: Final = Holds(
    "TwinCAT", 255, CODESYS, frozenset({"LINT", "ULINT", "LREAL"}), "controllers without 64-bit numbers"
)
DIALECT: Final = Dialect(POINTER)
CONTENT: Final = Objects()
_ADDRESSES: Final = {"from_node": "%I*", "to_node": "%Q*"}


def files(model: PdoModel) -> Iterator[ExportedFile]:
    """One for each object, and the table."""
    prefix = model.prefix
    head = header(model, "TwinCAT 3")
    for kind in data_types(model, DIALECT, CONTENT):
        text = object_text(model, "DUT", kind.name, lines_with(head, data_type_source(kind)))
        yield ExportedFile(f"{kind.name}.TcDUT", text, line_end="\r\n")
    for unit in blocks(model, DIALECT, CONTENT):
        yield unit_file(model, unit, head)
    placed = tuple(replace(each, address=_ADDRESSES.get(each.name, "")) for each in data(model))
    about = (*head, *overview(model), *pdo_lines(model))
    lines = ["{attribute 'qualified_only'}", *section_source(VariableSection("VAR_GLOBAL", placed))]
    text = object_text(model, "GVL", f"{prefix}_Data", lines_with(about, lines))
    yield ExportedFile(f"{prefix}_Data.TcGVL", text, line_end="\r\n")
    yield ExportedFile(f"{prefix}_Objects.txt", "\n".join(_table(model)) + "\n", line_end="\r\n")
    yield unit_file(model, main(model, shared=f"{prefix}_Data."), (beginning(model),), once=True)


def _table(model: PdoModel) -> Iterator[str]:
    """What is linked in the tree of the I/O."""

    def variable(pdo: PdoImage, entry: PdoTag | PdoWord) -> str:
        side = "from_node" if pdo.transmits else "to_node"
        return f"{model.prefix}_Data.{side}.{pdo.name}.{entry.object_name}"

    yield from header(model, "variables of the CANopen box, and the variables of the PLC to link them to")
    yield ""
    yield from pdo_lines(model)
    yield ""
    yield from object_table(model, variable)
