"""TwinCAT 3: one file for each data type, block and list of variables, as the project tree has them.

The client is that of TF6250. Identifiers are made from the names, so that making a file anew changes nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.polling import plan_lines
from gatewayd.links.modbus_server.plc.st.beckhoff import client
from gatewayd.links.modbus_server.plc.st.exchange import sequence
from gatewayd.links.modbus_server.plc.st.main import blocks, data, main
from gatewayd.links.modbus_server.plc.st.types import data_types
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import CODESYS
from gatewayd.plc.names import Holds
from gatewayd.plc.st.cast import POINTER
from gatewayd.plc.st.convert import functions
from gatewayd.plc.st.dialect import Dialect, own
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection
from gatewayd.plc.st.source import data_type_source, section_source
from gatewayd.plc.st.tree import lines_with, object_text, unit_file

HOLDS: Final = Holds(
    "TwinCAT", 255, CODESYS, frozenset({"LINT", "ULINT", "LREAL"}), "controllers without 64-bit numbers"
)
DIALECT: Final = Dialect(POINTER)


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """One for each object."""
    prefix = model.prefix
    head = header(model, "TwinCAT 3")
    for kind in data_types(model, DIALECT):
        text = object_text(model, "DUT", kind.name, lines_with(head, data_type_source(kind)))
        yield ExportedFile(f"{kind.name}.TcDUT", text, line_end="\r\n")
    for unit in (*functions(model, DIALECT), *blocks(model, DIALECT), sequence(model), client(model)):
        yield unit_file(model, unit, head)
    variables = section_source(VariableSection("VAR_GLOBAL", data(model)))
    about = (*head, *overview(model), *plan_lines(model))
    lines = lines_with(about, ["{attribute 'qualified_only'}", *variables])
    text = object_text(model, "GVL", f"{prefix}_Data", lines)
    yield ExportedFile(f"{prefix}_Data.TcGVL", text, line_end="\r\n")
    yield unit_file(model, _main(model), (beginning(model),), once=True)


def _main(model: PlcModel) -> ProgramUnit:
    shared = f"{model.prefix}_Data."
    write = "write" if model.inputs else "FALSE"
    call = (
        f"client(run := TRUE, trusted := {shared}status.trusted, write := {write}, image := {shared}image);"
    )
    return main(model, [call], [PlcVariable("client", own(f"{model.prefix}_Client"))], shared=shared)
