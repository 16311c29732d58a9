"""TIA Portal's MB_CLIENT around the poll plan, and its conversions of bits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.st.exchange import (
    FAILURES,
    RUN,
    WRITTEN,
    cyclic,
    demands,
    sequence_call,
)
from gatewayd.plc.st.convert import function
from gatewayd.plc.st.dialect import Primitives, elementary, own
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection

_MODES: Final = {1: 101, 2: 102, 3: 103, 4: 104, 15: 115, 16: 116}
"""Function code -> MB_MODE with addresses from 0 to 65535: the 4xxxxx modes end below the status block."""
_TCP: Final = 11
_PAIRS: Final = (("REAL", "DWORD"), ("LREAL", "LWORD"))


def _units(prefix: str) -> tuple[ProgramUnit, ...]:
    found = []
    for real, bits in _PAIRS:
        for verb, result, operand, kind in (("To", real, "bits", bits), ("From", bits, "value", real)):
            name = f"{prefix}_{verb}{real.capitalize()}"
            body = (f"#{name} := {kind}_TO_{result}({operand});",)
            found.append(function(name, result, ((operand, kind),), body, comment="the bits are copied"))
    return tuple(found)


CONVERSION: Final = Primitives(_units)
"""DWORD_TO_REAL copies bits there, which elsewhere converts a number."""


def client(model: PlcModel) -> ProgramUnit:
    """The block: one instance of MB_CLIENT, called for the array of each step."""
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Client",
        (
            VariableSection(
                "VAR_INPUT",
                (
                    *RUN,
                    PlcVariable(
                        "interface",
                        elementary("HW_ANY"),
                        "hardware identifier of the interface",
                        "64",
                    ),
                    PlcVariable("connection_id", elementary("CONN_OUC"), "free in this PLC", "1"),
                    *demands(model),
                ),
            ),
            VariableSection(
                "VAR_OUTPUT",
                (
                    FAILURES,
                    PlcVariable("error_status", elementary("WORD"), "STATUS of the last one"),
                    WRITTEN,
                ),
            ),
            VariableSection(
                "VAR",
                (
                    PlcVariable("sequence", own(f"{model.prefix}_Sequence")),
                    PlcVariable("client", elementary("MB_CLIENT")),
                    PlcVariable("connection", elementary("TCON_IP_v4")),
                    PlcVariable("done", elementary("BOOL")),
                    PlcVariable("busy", elementary("BOOL")),
                    PlcVariable("failed", elementary("BOOL")),
                    PlcVariable("status", elementary("WORD")),
                ),
            ),
        ),
        tuple(_body(model)),
        comment="the poll plan by MB_CLIENT",
    )


def _body(model: PlcModel) -> Iterator[str]:
    yield "connection.InterfaceId := interface;"
    yield "connection.ID := connection_id;"
    yield f"connection.ConnectionType := {_TCP};"
    yield "connection.ActiveEstablished := TRUE;"
    for position, part in enumerate(model.host.split("."), 1):
        yield f"connection.RemoteAddress.ADDR[{position}] := {part};"
    yield f"connection.RemotePort := {model.port};"
    yield f"client.MB_Unit_ID := {model.unit};"
    yield sequence_call(model)
    yield "done := FALSE;"
    yield "failed := FALSE;"
    yield "CASE sequence.current OF"
    for step, poll in enumerate(cyclic(model), 1):
        yield f"  {step}: // {poll.what}"
        yield "    client(REQ := sequence.request, DISCONNECT := FALSE, CONNECT := connection,"
        yield f"      MB_MODE := {_MODES[poll.function]}, MB_DATA_ADDR := {poll.address}, MB_DATA_LEN := {poll.count},"
        yield f'      MB_DATA_PTR := "{model.prefix}_Data".image.{poll.name},'
        yield "      DONE => done, BUSY => busy, ERROR => failed, STATUS => status);"
    yield "END_CASE;"
    yield "IF failed THEN"
    yield "  error_status := status;"
    yield "END_IF;"
    yield "failures := sequence.failures;"
    yield "written := sequence.written;"
