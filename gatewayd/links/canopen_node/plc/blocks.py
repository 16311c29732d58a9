"""The data types and blocks of the program: PDOs to values, values to PDOs, and a program that calls them."""

from __future__ import annotations

from gatewayd.links.canopen_node.plc.content import Content
from gatewayd.links.canopen_node.plc.data import data, shared_data
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.links.canopen_node.plc.watch import OPERATIONAL, present, watch
from gatewayd.plc.st.dialect import Dialect, elementary, own
from gatewayd.plc.st.program import (
    DataType,
    PlcVariable,
    ProgramUnit,
    Structure,
    VariableSection,
    indented,
    used,
)
from gatewayd.plc.st.scaling import JOINED, SCRATCH, UNREADABLE, fallback
from gatewayd.plc.st.types import named_types, status_type, value_types


def data_types(model: PdoModel, dialect: Dialect, content: Content) -> tuple[DataType, ...]:
    """All of them, what others are made of first."""
    found = [*named_types(model, dialect), *value_types(model), *content.types(model)]
    for name, pdos, text in (
        ("FromNode", model.from_node, "what the master receives of the node: its TPDOs"),
        ("ToNode", model.to_node, "what the master sends to the node: its RPDOs"),
    ):
        if pdos:
            members_of = tuple(content.member(model, pdo) for pdo in pdos)
            found.append(Structure(f"{model.prefix}_{name}", members_of, text))
    return (*found, status_type(model, dialect, present(model)))


def blocks(model: PdoModel, dialect: Dialect, content: Content) -> tuple[ProgramUnit, ...]:
    """What a program calls."""
    found = [watch(model, dialect, content)]
    if model.outputs:
        found.append(unpack(model, dialect, content))
    if model.inputs:
        found.append(pack(model, dialect, content))
    return tuple(found)


def unpack(model: PdoModel, dialect: Dialect, content: Content) -> ProgramUnit:
    """The block that brings the values of the robot into the structure of outputs."""
    decoded = [
        line
        for family in model.outputs
        for tag in family.tags
        for line in content.read(tag, model, dialect)  # type: ignore[arg-type]  # the tags of this model
    ]
    lost = [line for family in model.outputs for tag in family.tags for line in fallback(tag)]
    told = any(UNREADABLE.name in line for line in decoded)
    if told:
        decoded.insert(0, "unreadable := FALSE;")
    body = ["IF trusted THEN", *indented(decoded)]
    if lost:
        body += ["ELSE", *indented(lost)]
    trusted = PlcVariable(
        "trusted", elementary("BOOL"), "from the status: otherwise each value is what on_stale says"
    )
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Unpack",
        (
            VariableSection("VAR_INPUT", (trusted,)),
            VariableSection("VAR_OUTPUT", (UNREADABLE,) if told else ()),
            VariableSection("VAR_IN_OUT", shared_data(model, "from_node", "outputs")),
            VariableSection("VAR", used(body, *JOINED)),
        ),
        (*body, "END_IF;"),
        comment="PDOs to values of the robot",
    )


def pack(model: PdoModel, dialect: Dialect, content: Content) -> ProgramUnit:
    """The block that brings the structure of inputs into the PDOs that the master sends."""
    lines = ["clipped := FALSE;"]
    for pdo in model.to_node:
        lines += content.write(pdo, model, dialect)
    clipped = PlcVariable(
        "clipped", elementary("BOOL"), "a value was NaN, or beyond what its object can hold"
    )
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Pack",
        (
            VariableSection("VAR_OUTPUT", (clipped,)),
            VariableSection("VAR_IN_OUT", shared_data(model, "inputs", "to_node")),
            VariableSection("VAR", used(lines, *SCRATCH)),
        ),
        tuple(lines),
        comment="values for the robot to PDOs",
    )


def main(model: PdoModel, *, shared: str = "", notes: tuple[str, str] = ("", "")) -> ProgramUnit:
    """A program to begin with.

    `shared`: where the data are, if not in the program itself: `GW_Data.`; `notes`: what belongs before and behind it.
    """
    prefix = model.prefix
    instances = [] if shared else [*data(model)]
    instances += [PlcVariable("watch", own(f"{prefix}_Watch")), OPERATIONAL]
    before, behind = notes
    body = [before] if before else []
    source = f"from_node := {shared}from_node, " if model.from_node else ""
    body.append(f"watch(operational := operational, {source}status := {shared}status);")
    if model.outputs:
        instances.append(PlcVariable("unpack", own(f"{prefix}_Unpack")))
        body.append(
            f"unpack(trusted := {shared}status.trusted, from_node := {shared}from_node, outputs := {shared}outputs);"
        )
    body += ["", "(* your program: it reads outputs, and writes inputs *)", ""]
    if model.inputs:
        write = PlcVariable(
            "write", elementary("BOOL"), "set it when the inputs hold what you want: nothing is packed before"
        )
        instances += [PlcVariable("pack", own(f"{prefix}_Pack")), write]
        body += [
            f"IF write AND {shared}status.trusted THEN",
            f"  pack(inputs := {shared}inputs, to_node := {shared}to_node);",
            "END_IF;",
        ]
    body += [behind] if behind else []
    return ProgramUnit("PROGRAM", f"{prefix}_Main", (VariableSection("VAR", tuple(instances)),), tuple(body))
