"""The blocks of a cell, the variables that they work on, and the program that calls them."""

from __future__ import annotations

from collections.abc import Sequence

from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.st.decode import unpack
from gatewayd.links.modbus_server.plc.st.encode import pack
from gatewayd.links.modbus_server.plc.st.exchange import handshake
from gatewayd.links.modbus_server.plc.st.self_test import self_test
from gatewayd.links.modbus_server.plc.st.watch import watch
from gatewayd.plc.st.dialect import Dialect, elementary, own
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection

WRITE = PlcVariable(
    "write", elementary("BOOL"), "set it when the inputs hold what you want: nothing is written before"
)


def blocks(model: PlcModel, dialect: Dialect) -> tuple[ProgramUnit, ...]:
    """What a program calls, but for the exchange of requests."""
    found = [watch(model, dialect)]
    if model.outputs:
        found.append(unpack(model, dialect))
    if model.inputs:
        found += [pack(model, dialect), handshake(model)]
    if model.self_test is not None:
        found.append(self_test(model, model.self_test, dialect))
    return tuple(found)


def data(model: PlcModel) -> tuple[PlcVariable, ...]:
    """One variable of each of the program's data types."""
    present = {"Inputs": bool(model.inputs), "Outputs": bool(model.outputs)}
    return tuple(
        PlcVariable(name.lower(), own(f"{model.prefix}_{name}"))
        for name in ("Image", "Status", "Numbers", "Inputs", "Outputs")
        if present.get(name, True)
    )


def main(
    model: PlcModel, exchange: Sequence[str], variables: Sequence[PlcVariable], *, shared: str = ""
) -> ProgramUnit:
    """A program to begin with.

    `exchange`: the lines that send the requests. `shared`: where the data are, if not in the program itself: `GW_Data.`
    """
    prefix = model.prefix
    instances = [] if shared else [*data(model)]
    instances.append(PlcVariable("watch", own(f"{prefix}_Watch")))
    body = [f"watch(image := {shared}image, status := {shared}status);"]
    if model.outputs:
        instances.append(PlcVariable("unpack", own(f"{prefix}_Unpack")))
        body += [
            f"unpack(trusted := {shared}status.trusted, image := {shared}image, outputs := {shared}outputs);"
        ]
    body += ["", "(* your program: it reads outputs, and writes inputs *)", ""]
    if model.inputs:
        instances += [PlcVariable("pack", own(f"{prefix}_Pack")), WRITE]
        body.append(f"pack(inputs := {shared}inputs, image := {shared}image);")
    section = VariableSection("VAR", (*instances, *variables))
    return ProgramUnit("PROGRAM", f"{prefix}_Main", (section,), (*body, *exchange))
