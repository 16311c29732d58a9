"""The client of TwinCAT's TF6250 (library Tc2_ModbusSrv) around the poll plan."""

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
from gatewayd.plc.st.dialect import array, elementary, own
from gatewayd.plc.st.program import (
    PlcVariable,
    ProgramUnit,
    TypeName,
    VariableSection,
    indented,
)

_BLOCKS: Final = {
    1: ("read_coils", "FB_MBReadCoils"),
    2: ("read_inputs", "FB_MBReadInputs"),
    3: ("read_registers", "FB_MBReadRegs"),
    4: ("read_input_registers", "FB_MBReadInputRegs"),
    15: ("write_coils", "FB_MBWriteCoils"),
    16: ("write_registers", "FB_MBWriteRegs"),
}
"""Function code -> instance and block."""
_OF_BITS: Final = frozenset({1, 2, 15})
_WRITING: Final = frozenset({15, 16})
_MOST_BYTES: Final = 250


def client(model: PlcModel) -> ProgramUnit:
    """The block: one request at a time, whichever the sequence wants."""
    used = sorted({poll.function for poll in model.polls})
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Client",
        (
            VariableSection(
                "VAR_INPUT",
                (
                    *RUN,
                    PlcVariable("host", elementary("STRING"), "address of the gateway", f"'{model.host}'"),
                    PlcVariable("port", elementary("UINT"), "", str(model.port)),
                    PlcVariable("unit", elementary("BYTE"), "", str(model.unit)),
                    PlcVariable("time_out", elementary("TIME"), "for one request", "T#1s"),
                    *demands(model),
                ),
            ),
            VariableSection(
                "VAR_OUTPUT",
                (
                    FAILURES,
                    PlcVariable("error_id", elementary("UDINT"), "nErrId of the last one"),
                    WRITTEN,
                ),
            ),
            VariableSection("VAR_IN_OUT", (PlcVariable("image", own(f"{model.prefix}_Image")),)),
            VariableSection(
                "VAR",
                (
                    PlcVariable("sequence", own(f"{model.prefix}_Sequence")),
                    *(PlcVariable(_BLOCKS[code][0], own(_BLOCKS[code][1])) for code in used),
                    PlcVariable("code", elementary("INT")),
                    PlcVariable("address", elementary("WORD")),
                    PlcVariable("quantity", elementary("WORD")),
                    PlcVariable("bytes", elementary("UDINT")),
                    PlcVariable("buffer", TypeName("BYTE", is_pointer=True)),
                    PlcVariable("bits", array("BYTE", _MOST_BYTES - 1)),
                    PlcVariable("busy", elementary("BOOL")),
                    PlcVariable("was_busy", elementary("BOOL")),
                    PlcVariable("wrong", elementary("BOOL")),
                    PlcVariable("done", elementary("BOOL")),
                    PlcVariable("failed", elementary("BOOL")),
                    PlcVariable("n", elementary("INT")),
                ),
            ),
        ),
        tuple(_body(model, used)),
        comment="the poll plan by the blocks of TF6250",
    )


def _body(model: PlcModel, used: list[int]) -> Iterator[str]:
    yield sequence_call(model, "time_out")
    yield "failures := sequence.failures;"
    yield "written := sequence.written;"
    yield "CASE sequence.current OF"
    for step, poll in enumerate(cyclic(model), 1):
        yield f"  {step}:"
        yield f"    code := {poll.function};"
        yield f"    address := {poll.address};"
        yield f"    quantity := {poll.count};"
        yield f"    bytes := {(poll.count + 7) // 8 if poll.area.of_bits else 2 * poll.count};"
        yield f"    buffer := ADR({'bits' if poll.area.of_bits else f'image.{poll.name}'});"
        if poll.function in _OF_BITS & _WRITING:
            yield from indented(list(_to_bits(poll.name, poll.count)), 2)
    yield "END_CASE;"
    for code in used:
        yield from _call(code)
    instances = [_BLOCKS[code][0] for code in used]
    yield f"busy := {' OR '.join(f'{name}.bBusy' for name in instances)};"
    yield f"wrong := {' OR '.join(f'{name}.bError' for name in instances)};"
    yield "failed := sequence.request AND wrong AND NOT busy;"
    yield "done := sequence.request AND was_busy AND NOT busy AND NOT wrong;"
    yield "was_busy := busy AND sequence.request;"
    for code in used:
        yield f"IF {_BLOCKS[code][0]}.bError THEN"
        yield f"  error_id := {_BLOCKS[code][0]}.nErrId;"
        yield "END_IF;"
    yield from _from_bits(model)


def _call(code: int) -> Iterator[str]:
    name, _block = _BLOCKS[code]
    pointer = "pSrcAddr" if code in _WRITING else "pDestAddr"
    yield f"{name}(sIPAddr := host, nTCPPort := port, nUnitID := unit, nQuantity := quantity, nMBAddr := address,"
    yield f"  cbLength := bytes, {pointer} := buffer, bExecute := sequence.request AND (code = {code}),"
    yield "  tTimeout := time_out);"


def _to_bits(name: str, count: int) -> Iterator[str]:
    """Coils go over the wire eight to a byte."""
    yield f"FOR n := 0 TO {(count + 7) // 8 - 1} DO"
    yield "  bits[n] := 0;"
    yield "END_FOR;"
    yield f"FOR n := 0 TO {count - 1} DO"
    yield f"  IF image.{name}[n] THEN"
    yield "    bits[n / 8] := bits[n / 8] OR SHL(BYTE#1, n MOD 8);"
    yield "  END_IF;"
    yield "END_FOR;"


def _from_bits(model: PlcModel) -> Iterator[str]:
    for step, poll in enumerate(cyclic(model), 1):
        if poll.function in _OF_BITS - _WRITING:
            yield f"IF done AND (sequence.current = {step}) THEN"
            yield f"  FOR n := 0 TO {poll.count - 1} DO"
            yield f"    image.{poll.name}[n] := (SHR(bits[n / 8], n MOD 8) AND BYTE#1) <> BYTE#0;"
            yield "  END_FOR;"
            yield "END_IF;"
