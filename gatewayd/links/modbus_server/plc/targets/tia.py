"""TIA Portal: external sources in SCL, from which blocks are generated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.build import refuse_name
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.polling import plan_lines
from gatewayd.links.modbus_server.plc.st.exchange import sequence
from gatewayd.links.modbus_server.plc.st.main import blocks, data, main
from gatewayd.links.modbus_server.plc.st.siemens import CONVERSION, client
from gatewayd.links.modbus_server.plc.st.types import data_types
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import SIEMENS
from gatewayd.plc.names import Holds
from gatewayd.plc.st.convert import functions
from gatewayd.plc.st.dialect import Dialect, own
from gatewayd.plc.st.program import PlcVariable, ProgramUnit
from gatewayd.plc.st.scl import data_block, note, type_source, unit_source

HOLDS: Final = Holds("TIA Portal", 125, SIEMENS, frozenset({"LINT", "ULINT"}), "S7-1200 controllers")
DIALECT: Final = Dialect(CONVERSION, names_operands=True, quotes=True, enumerations=False)


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """Data types first, then the data block, functions, blocks, and a block to begin with."""
    refuse_name(model.host, "TCON_IP_v4")
    prefix = model.prefix
    head = header(model, "TIA Portal")
    about = (*head, *overview(model), *plan_lines(model))
    yield _file(f"{prefix}_1_Types.udt", about, map(type_source, data_types(model, DIALECT)))
    yield _file(f"{prefix}_2_Data.db", head, [data_block(f"{prefix}_Data", data(model))])
    units = [*functions(model, DIALECT), *blocks(model, DIALECT), sequence(model), client(model)]
    yield _file(f"{prefix}_3_Blocks.scl", head, map(unit_source, units))
    yield _file(f"{prefix}_4_Main.scl", (beginning(model),), [unit_source(_main(model))], once=True)


def _main(model: PlcModel) -> ProgramUnit:
    """A block, to be called in OB1 with an instance."""
    shared = f'"{model.prefix}_Data".'
    write = "write" if model.inputs else "FALSE"
    call = f"client(run := TRUE, trusted := {shared}status.trusted, write := {write});"
    variables = [PlcVariable("client", own(f"{model.prefix}_Client"))]
    program = main(model, [call], variables, shared=shared)
    return ProgramUnit("FUNCTION_BLOCK", program.name, program.sections, program.body)


def _file(name: str, head: Iterable[str], parts: Iterable[list[str]], *, once: bool = False) -> ExportedFile:
    lines = [*map(note, head)]
    for part in parts:
        lines += ["", *part]
    return ExportedFile(name, "\n".join(lines) + "\n", "utf-8-sig", "\r\n", once)
