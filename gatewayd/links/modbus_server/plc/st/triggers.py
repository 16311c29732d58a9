"""Pulses for write channels that a tool's own Modbus master serves: it reads by itself, and writes when told to."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.st.exchange import demands
from gatewayd.plc.st.dialect import elementary
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection


def triggers(model: PlcModel) -> ProgramUnit:
    """The block; its outputs are the triggers of the channels, which write when they rise."""
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Triggers",
        (
            VariableSection(
                "VAR_INPUT",
                (
                    PlcVariable("trusted", elementary("BOOL"), "from the status: nothing is written before"),
                    PlcVariable("write", elementary("BOOL"), "the inputs hold what you want: write them"),
                    PlcVariable("failing", elementary("BOOL"), "xError of the server device"),
                    PlcVariable(
                        "period",
                        elementary("TIME"),
                        "from write to write",
                        f"T#{round(model.period * 1000)}ms",
                    ),
                    *demands(model),
                ),
            ),
            VariableSection(
                "VAR_OUTPUT",
                (
                    *(
                        PlcVariable(poll.name, elementary("BOOL"), "trigger of the channel of this name")
                        for poll in model.writes
                    ),
                    PlcVariable("written", elementary("UDINT"), "rounds of writes without an error"),
                ),
            ),
            VariableSection(
                "VAR", (PlcVariable("pause", elementary("TON")), PlcVariable("high", elementary("BOOL")))
            ),
        ),
        tuple(_pulses(model)),
        comment="triggers of the write channels",
    )


def _pulses(model: PlcModel) -> Iterator[str]:
    yield "pause(IN := trusted AND write AND NOT pause.Q, PT := period / 2);"
    yield "IF NOT (trusted AND write) THEN"
    yield "  high := FALSE;"
    yield "ELSIF pause.Q THEN"
    yield "  high := NOT high;"
    yield "  IF high AND NOT failing THEN"
    yield "    written := written + 1;"
    yield "  END_IF;"
    yield "END_IF;"
    for poll in model.writes:
        wanted = f" AND demand_{poll.name}" if poll.shared else ""
        yield f"{poll.name} := high{wanted};"
