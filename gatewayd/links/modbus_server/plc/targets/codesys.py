"""CODESYS 3: PLCopen XML for the program, and a table for the channels of the Modbus TCP server device.

The device's own import format is not documented, so its channels are printed; they are typed in once. The device reads
by itself; it writes when a trigger rises, so that nothing is written before the program says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.model import PlcModel, Poll
from gatewayd.links.modbus_server.plc.st.main import blocks, data, main
from gatewayd.links.modbus_server.plc.st.triggers import triggers
from gatewayd.links.modbus_server.plc.st.types import data_types
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import CODESYS
from gatewayd.plc.names import Holds
from gatewayd.plc.st.cast import POINTER
from gatewayd.plc.st.convert import functions
from gatewayd.plc.st.dialect import Dialect, elementary, own
from gatewayd.plc.st.plcopen import project
from gatewayd.plc.st.program import PlcVariable, ProgramUnit

HOLDS: Final = Holds(
    "CODESYS", 255, CODESYS, frozenset({"LINT", "ULINT", "LREAL"}), "controllers without 64-bit numbers"
)
DIALECT: Final = Dialect(POINTER)
_SLOW: Final = 1000
"""Milliseconds from one reading of a slow table to the next."""
_FUNCTIONS: Final = {
    1: "Read Coils",
    2: "Read Discrete Inputs",
    3: "Read Holding Registers",
    4: "Read Input Registers",
    15: "Write Multiple Coils",
    16: "Write Multiple Registers",
}


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """The program, its channels, and a program to begin with."""
    prefix = model.prefix
    units = [*functions(model, DIALECT), *blocks(model, DIALECT)]
    if model.writes:
        units.append(triggers(model))
    yield ExportedFile(
        f"{prefix}_Import.xml",
        project(
            f"{prefix}_Import",
            (*header(model, "data types and blocks"), *overview(model)),
            data_types(model, DIALECT),
            units,
            (f"{prefix}_Data", data(model)),
        ),
    )
    yield ExportedFile(f"{prefix}_Channels.txt", "\n".join(_channels(model)) + "\n")
    program = project(f"{prefix}_Main", (beginning(model),), (), [_main(model)])
    yield ExportedFile(f"{prefix}_Main.xml", program, once=True)


def _channels(model: PlcModel) -> Iterator[str]:
    """What is typed into the dialogs of the server device, and mapped to the arrays of the image."""
    yield from header(model, "channels of the Modbus TCP server device")
    yield ""
    yield f"Modbus TCP server, general: address {model.host}, port {model.port}, unit-ID {model.unit}"
    yield "Every channel: error handling keep last value. What is not trusted is dealt with by the program."
    rows = [
        ("Name", "Access Type", "Trigger", "Offset", "Length", "I/O mapping"),
        *map(_row(model), model.polls),
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    yield ""
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _row(model: PlcModel) -> Callable[[Poll], tuple[str, ...]]:
    def row(poll: Poll) -> tuple[str, ...]:
        cycle = _SLOW if poll.slow else round(model.period * 1000)
        trigger = (
            f"Rising edge, {model.prefix}_Main.triggers.{poll.name}" if poll.writes else f"Cyclic, {cycle} ms"
        )
        access = f"{_FUNCTIONS[poll.function]} (Function Code {poll.function})"
        return (
            poll.name,
            access,
            trigger,
            str(poll.address),
            str(poll.count),
            f"{model.prefix}_Data.image.{poll.name}",
        )

    return row


def _main(model: PlcModel) -> ProgramUnit:
    shared = f"{model.prefix}_Data."
    variables, lines = [], []
    if model.writes:
        variables = [
            PlcVariable("triggers", own(f"{model.prefix}_Triggers")),
            PlcVariable("failing", elementary("BOOL"), "set it to xError of the server device"),
        ]
        lines = [f"triggers(trusted := {shared}status.trusted, write := write, failing := failing);"]
    return main(model, lines, variables, shared=shared)
