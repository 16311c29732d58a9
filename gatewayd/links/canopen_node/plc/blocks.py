"""The data types and blocks of the program: PDOs to values, values to PDOs, the status words watched."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from gatewayd.core.image import Quality
from gatewayd.core.status_layout import LAYOUT_VERSION
from gatewayd.links.canopen_node.plc.content import Content
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.plc.st.dialect import Dialect, elementary, own, word
from gatewayd.plc.st.naming import FLAGS, literal_of, name_of, trusted_name
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
from gatewayd.plc.st.types import meanings, named_types, status_type, value_types

_ALWAYS = frozenset({"alive", "right_mapping", "wrong_mapping", "trusted"})
_OPERATIONAL = PlcVariable(
    "operational", elementary("BOOL"), "the master says that the node is operational and not lost"
)


def data_types(model: PdoModel, dialect: Dialect, content: Content) -> tuple[DataType, ...]:
    """All of them, what others are made of first."""
    present = set(_ALWAYS)
    if model.word("fingerprint") is not None:
        present.add("fingerprint")
    for field, (members, _decode) in _DECODED.items():
        if model.word(field) is not None:
            present.update(members)
    if model.qualities:
        present.update(("good", "quality"))
    found = [*named_types(model, dialect), *value_types(model), *content.types(model)]
    for name, pdos, text in (
        ("FromNode", model.from_node, "what the master receives of the node: its TPDOs"),
        ("ToNode", model.to_node, "what the master sends to the node: its RPDOs"),
    ):
        if pdos:
            members_of = tuple(content.member(model, pdo) for pdo in pdos)
            found.append(Structure(f"{model.prefix}_{name}", members_of, text))
    return (*found, status_type(model, dialect, present))


def data(model: PdoModel) -> tuple[PlcVariable, ...]:
    """One variable of each of the program's data types; those that the master fills and sends first."""
    prefix = model.prefix
    present = (
        ("from_node", "FromNode", bool(model.from_node)),
        ("to_node", "ToNode", bool(model.to_node)),
        ("status", "Status", True),
        ("numbers", "Numbers", True),
        ("inputs", "Inputs", bool(model.inputs)),
        ("outputs", "Outputs", bool(model.outputs)),
    )
    return tuple(PlcVariable(name, own(f"{prefix}_{kind}")) for name, kind, is_there in present if is_there)


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
            VariableSection("VAR_IN_OUT", _shared(model, "from_node", "outputs")),
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
            VariableSection("VAR_IN_OUT", _shared(model, "inputs", "to_node")),
            VariableSection("VAR", used(lines, *SCRATCH)),
        ),
        tuple(lines),
        comment="values for the robot to PDOs",
    )


def _shared(model: PdoModel, *names: str) -> tuple[PlcVariable, ...]:
    return tuple(variable for variable in data(model) if variable.name in names)


def watch(model: PdoModel, dialect: Dialect, content: Content) -> ProgramUnit:
    """The block for the status: as much of it as the TPDOs have."""
    body = [
        *_liveness(model, dialect, content),
        *_numbers(model, dialect, content),
        *_qualities(model, dialect, content),
    ]
    patience = PlcVariable(
        "patience", elementary("TIME"), "without a heartbeat the gateway counts as lost", "T#1s"
    )
    local = (
        PlcVariable("silence", elementary("TON")),
        PlcVariable("last_beat", elementary("WORD")),
        PlcVariable("last_refusals", elementary("UDINT")),
        PlcVariable("started", elementary("BOOL")),
        PlcVariable("known", elementary("BOOL"), "the count of refusals"),
    )
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Watch",
        (
            VariableSection("VAR_INPUT", (_OPERATIONAL, *used(body, patience))),
            VariableSection("VAR_IN_OUT", _shared(model, "from_node", "status")),
            VariableSection("VAR", used(body, *local)),
        ),
        tuple(body),
        comment="the status words in the TPDOs of the node",
    )


def _liveness(model: PdoModel, dialect: Dialect, content: Content) -> Iterator[str]:
    heartbeat = model.word("heartbeat")
    if heartbeat is None:
        yield "status.alive := operational;"
    else:
        beat = content.word(heartbeat, model, dialect)
        yield f"silence(IN := started AND ({beat} = last_beat), PT := patience);"
        yield f"IF operational AND started AND ({beat} <> last_beat) THEN"
        yield "  status.alive := TRUE;"
        yield "ELSIF silence.Q OR NOT started OR NOT operational THEN"
        yield "  status.alive := FALSE;"
        yield "END_IF;"
        yield "started := operational;"
        yield f"last_beat := {beat};"
    right = []
    layout, fingerprint = model.word("layout"), model.word("fingerprint")
    if layout is not None:
        right.append(f"({content.word(layout, model, dialect)} = {word(LAYOUT_VERSION)})")
    if fingerprint is not None:
        yield f"status.fingerprint := {content.word(fingerprint, model, dialect)};"
        right.append(f"(status.fingerprint = DWORD#16#{model.fingerprint:08X})")
    yield f"status.right_mapping := {' AND '.join(right) or 'TRUE'};"
    yield "status.wrong_mapping := status.alive AND NOT status.right_mapping;"
    yield "status.trusted := status.alive AND status.right_mapping;"


def _numbers(model: PdoModel, dialect: Dialect, content: Content) -> Iterator[str]:
    for field, (members, decode) in _DECODED.items():
        found = model.word(field)
        if found is not None:
            yield from decode(content.word(found, model, dialect), members[0], model, dialect)


def _flags(place: str, _member: str, _model: PdoModel, _dialect: Dialect) -> Iterator[str]:
    for bit, name in FLAGS.items():
        yield f"status.{name} := status.trusted AND (({place} AND {word(1 << bit)}) <> {word(0)});"


def _state(place: str, member: str, model: PdoModel, dialect: Dialect) -> Iterator[str]:
    return trusted_name(member, place, member.removesuffix("_state"), model, dialect)


def _age(place: str, member: str, _model: PdoModel, _dialect: Dialect) -> Iterator[str]:
    yield f"status.{member} := DWORD_TO_UDINT({place});"
    yield "IF NOT status.trusted THEN"
    yield f"  status.{member} := UDINT#4294967295;"
    yield "END_IF;"


def _refusals(place: str, member: str, _model: PdoModel, _dialect: Dialect) -> Iterator[str]:
    yield f"status.{member} := DWORD_TO_UDINT({place});"
    yield f"status.refused_now := status.trusted AND known AND (status.{member} <> last_refusals);"
    yield "known := status.trusted;"
    yield f"last_refusals := status.{member};"


def _reason(place: str, member: str, model: PdoModel, dialect: Dialect) -> Iterator[str]:
    return name_of(member, place, "refusal", model, dialect)


def _plain(place: str, member: str, _model: PdoModel, _dialect: Dialect) -> Iterator[str]:
    yield f"status.{member} := WORD_TO_UINT({place});"


_DECODED: Final[Mapping[str, tuple[tuple[str, ...], Callable[..., Iterator[str]]]]] = {
    "flags": (tuple(FLAGS.values()), _flags),
    "robot_state": (("robot_state",), _state),
    "program": (("program_state",), _state),
    "robot_age": (("robot_age",), _age),
    "refused": (("refusals", "refused_now"), _refusals),
    "refusal_reason": (("refusal",), _reason),
    "refusal_variable": (("refusal_variable",), _plain),
    "refusal_writer": (("refusal_writer",), _plain),
    "refusal_holder": (("refusal_holder",), _plain),
}
"""Word of the status block -> the members of the status that it brings, and the statements that do it."""


def _qualities(model: PdoModel, dialect: Dialect, content: Content) -> Iterator[str]:
    """Of variables whose quality is in no TPDO nothing is known."""
    named = [name for name, _text in meanings()["quality"]]
    mapped = {found.number: found for found in model.qualities}
    if not mapped:
        return
    for number in range(1, len(model.variables) + 1):
        if number in mapped:
            place = content.word(mapped[number], model, dialect)
            yield from trusted_name(f"quality[{number}]", place, "quality", model, dialect)
            good = literal_of("quality", Quality.GOOD, model, dialect)
            yield f"status.good[{number}] := status.quality[{number}] = {good};"
        else:
            unknown = literal_of("quality", named.index("unknown"), model, dialect)
            yield f"status.quality[{number}] := {unknown};"
            yield f"status.good[{number}] := FALSE;"


def main(model: PdoModel, *, shared: str = "", notes: tuple[str, str] = ("", "")) -> ProgramUnit:
    """A program to begin with.

    `shared`: where the data are, if not in the program itself: `GW_Data.`; `notes`: what belongs before and behind it.
    """
    prefix = model.prefix
    instances = [] if shared else [*data(model)]
    instances += [PlcVariable("watch", own(f"{prefix}_Watch")), _OPERATIONAL]
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
