"""Structured text of IEC 61131-3 edition 2: no union, no `word.3`, names of 32 characters, bits to reals by arithmetic.

What a compiler of that edition takes, every later one takes too. The standard has no Modbus client, so the example
program says where the tool's own block belongs.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.polling import plan_lines
from gatewayd.links.modbus_server.plc.st.exchange import cyclic, sequence
from gatewayd.links.modbus_server.plc.st.main import blocks, main
from gatewayd.links.modbus_server.plc.st.types import data_types
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import IEC
from gatewayd.plc.names import Holds
from gatewayd.plc.st.convert import PORTABLE, functions
from gatewayd.plc.st.dialect import Dialect, elementary, own
from gatewayd.plc.st.program import PlcVariable, ProgramUnit
from gatewayd.plc.st.source import data_type_source, text_of, unit_source

HOLDS: Final = Holds(
    "edition 2",
    32,
    IEC,
    frozenset({"LINT", "ULINT", "LREAL"}),
    "controllers without 64-bit numbers",
)
DIALECT: Final = Dialect(PORTABLE)
_ANSWERS: Final = (("connected", ""), ("answered", ": one cycle long"), ("failed", ": one cycle long"))


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """Data types, functions, blocks, and a program to begin with."""
    prefix = model.prefix
    yield ExportedFile(
        f"{prefix}_Types.st",
        text_of(
            (*header(model, "data types"), *overview(model), *plan_lines(model)),
            map(data_type_source, data_types(model, DIALECT)),
        ),
    )
    yield ExportedFile(
        f"{prefix}_Convert.st",
        text_of(header(model, "conversions"), map(unit_source, functions(model, DIALECT))),
    )
    yield ExportedFile(
        f"{prefix}_Blocks.st",
        text_of(header(model, "blocks"), map(unit_source, (*blocks(model, DIALECT), sequence(model)))),
    )
    yield ExportedFile(
        f"{prefix}_Main.st",
        text_of(
            (beginning(model),),
            [unit_source(_main(model)), _configuration(model)],
        ),
        once=True,
    )


def _main(model: PlcModel) -> ProgramUnit:
    """The standard has no client: what one needs for each step stands in variables."""
    variables = [
        PlcVariable("sequence", own(f"{model.prefix}_Sequence")),
        *(
            PlcVariable(name, elementary("BOOL"), f"from your Modbus client block{more}")
            for name, more in _ANSWERS
        ),
        PlcVariable("function_code", elementary("INT"), "for your Modbus client block"),
        PlcVariable("address", elementary("UINT"), "for your Modbus client block"),
        PlcVariable("quantity", elementary("UINT"), "for your Modbus client block"),
    ]
    write = "write" if model.inputs else "FALSE"
    lines = [
        f"sequence(run := connected, trusted := status.trusted, write := {write}, done := answered, failed := failed);",
        "CASE sequence.current OF",
    ]
    for step, poll in enumerate(cyclic(model), 1):
        parts = f"function_code := {poll.function}; address := {poll.address}; quantity := {poll.count};"
        lines.append(f"  {step}: {parts} (* image.{poll.name} *)")
    lines += [
        "END_CASE;",
        "(* Call your Modbus client block here: it sends when sequence.request rises, with the array named above. *)",
    ]
    return main(model, lines, variables)


def _configuration(model: PlcModel) -> list[str]:
    return [
        f"CONFIGURATION {model.prefix}_Config",
        f"  RESOURCE {model.prefix}_Resource ON PLC",
        f"    TASK {model.prefix}_Task(INTERVAL := T#10ms, PRIORITY := 0);",
        f"    PROGRAM {model.prefix}_Instance WITH {model.prefix}_Task : {model.prefix}_Main;",
        "  END_RESOURCE",
        "END_CONFIGURATION",
    ]
