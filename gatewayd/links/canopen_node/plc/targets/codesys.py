"""CODESYS 3: PLCopen XML for the program, and a table of the objects that its CANopen manager maps to variables.

The manager reads the EDS and gives each object of a PDO a channel of its type; channels are mapped to existing
variables in the dialog for the I/O mapping of the device. The form in which that could be imported is not documented:
so it is a table.
"""

from __future__ import annotations

from collections.abc import Iterator
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
from gatewayd.plc.st.plcopen import project

HOLDS: Final = Holds(
    "CODESYS", 255, CODESYS, frozenset({"LINT", "ULINT", "LREAL"}), "controllers without 64-bit numbers"
)
DIALECT: Final = Dialect(POINTER)
CONTENT: Final = Objects()


def files(model: PdoModel) -> Iterator[ExportedFile]:
    """The program, its objects, and a program to begin with."""
    prefix = model.prefix
    about = (*header(model, "data types and blocks"), *overview(model), *pdo_lines(model))
    yield ExportedFile(
        f"{prefix}_Import.xml",
        project(
            f"{prefix}_Import",
            about,
            data_types(model, DIALECT, CONTENT),
            blocks(model, DIALECT, CONTENT),
            (f"{prefix}_Data", data(model)),
        ),
    )
    yield ExportedFile(f"{prefix}_Objects.txt", "\n".join(_table(model)) + "\n")
    program = project(f"{prefix}_Main", (beginning(model),), (), [main(model, shared=f"{prefix}_Data.")])
    yield ExportedFile(f"{prefix}_Main.xml", program, once=True)


def _table(model: PdoModel) -> Iterator[str]:
    """What is chosen in the dialog for the I/O mapping of the device."""

    def variable(pdo: PdoImage, entry: PdoTag | PdoWord) -> str:
        side = "from_node" if pdo.transmits else "to_node"
        return f"{model.prefix}_Data.{side}.{pdo.name}.{entry.object_name}"

    yield from header(model, "objects of the CANopen device, and the variables to map them to")
    yield ""
    yield from pdo_lines(model)
    yield ""
    yield from object_table(model, variable)
