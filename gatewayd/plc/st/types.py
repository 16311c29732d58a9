"""The data types of a program: inputs and outputs with their units and places, the status, names of numbers."""

from __future__ import annotations

from collections.abc import Container, Iterator

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.program import STATES
from gatewayd.core.refusal import Reason
from gatewayd.plc.model import CellModel, TagFamily
from gatewayd.plc.st.dialect import Dialect, array, elementary, own
from gatewayd.plc.st.program import (
    DataType,
    Enumeration,
    PlcVariable,
    Structure,
    TypeName,
)
from gatewayd.report.format import exact

Named = tuple[tuple[str, str], ...]


def meanings() -> dict[str, Named]:
    """Kind of number in the status block -> name and words of each number, from 0 without a gap."""
    return {
        "quality": (
            *((quality.name.lower(), "") for quality in Quality),
            ("unknown", "the gateway is not trusted now, or it is newer than this program"),
        ),
        "robot": (*((source.name.lower(), "") for source in Source), ("unknown", "newer than this program")),
        "refusal": (
            ("none", "nothing was refused yet"),
            *((reason.name.lower(), reason.text) for reason in Reason),
            ("unknown", "newer than this program"),
        ),
        "program": (
            ("unknown", "the controller does not report it, or newer than this program"),
            *((name, "") for name, _runs in STATES.values()),
        ),
    }


def named_types(model: CellModel, dialect: Dialect) -> Iterator[DataType]:
    """The names of numbers: enumerations, or a structure of constants where there are none."""
    prefix = model.prefix
    if dialect.enumerations:
        for kind, named in meanings().items():
            literals = tuple((f"{prefix}_{kind}_{name}", text) for name, text in named)
            yield Enumeration(f"{prefix}_{kind.capitalize()}", literals)
    else:
        yield Structure(f"{prefix}_Names", tuple(_names()), "what the numbers in the status mean")


def value_types(model: CellModel) -> Iterator[DataType]:
    """Inputs and outputs, and the number of each variable."""
    prefix = model.prefix
    if model.inputs:
        yield Structure(
            f"{prefix}_Inputs",
            tuple(map(member_field, model.inputs)),
            f"to the robot, written by {model.writer}",
        )
    if model.outputs:
        yield Structure(f"{prefix}_Outputs", tuple(map(member_field, model.outputs)), "from the robot")
    yield Structure(f"{prefix}_Numbers", tuple(_numbers(model)), "number of each variable in the status")


def status_type(model: CellModel, dialect: Dialect, present: Container[str] | None = None) -> Structure:
    """The status block decoded; `present`: the members for which the link brings something, all of them without it."""
    fields = tuple(member for member in _status(model, dialect) if present is None or member.name in present)
    return Structure(f"{model.prefix}_Status", fields, "the status block")


def member_field(member: TagFamily) -> PlcVariable:
    """A variable with its place, type on the wire, unit, limits and comment."""
    last = member.tags[-1].element
    kind = elementary(member.type) if last is None else array(member.type, last)
    return PlcVariable(member.name, kind, description(member))


def description(member: TagFamily) -> str:
    """`400021 (20) int16 ABCD * 0.1, N, 0 to 150: the comment`."""
    first, last = member.tags[0], member.tags[-1]
    where = first.notation if first is last else f"{first.notation} to {last.notation}"
    encoding = first.encoding
    how = "bit"
    if encoding is not None:
        how = f"{encoding.type} {encoding.order}".rstrip()
        how += f" * {exact(encoding.scale)}" if encoding.scale != 1 else ""
        how += f" + {exact(encoding.offset)}" if encoding.offset else ""
    limits = f", {exact(first.limits.low)} to {exact(first.limits.high)}" if first.limits else ""
    about = f": {first.comment}" if first.comment else ""
    return f"{where} {how}{f', {first.unit}' if first.unit else ''}{limits}{about}"


def has_wide(model: CellModel) -> bool:
    """Whether some number has 64 bits."""
    return any(
        tag.encoding is not None and tag.encoding.type.endswith("64")
        for member in (*model.inputs, *model.outputs)
        for tag in member.tags
    )


def _names() -> Iterator[PlcVariable]:
    for kind, named in meanings().items():
        for number, (name, text) in enumerate(named):
            yield PlcVariable(f"{kind}_{name}", elementary("INT"), text, str(number))


def _numbers(model: CellModel) -> Iterator[PlcVariable]:
    for member in (*model.inputs, *model.outputs):
        number = member.tags[0].number
        more = f"of element 0; element n has {number} + n" if member.is_array else ""
        yield PlcVariable(member.name, elementary("INT"), more, str(number))


def _status(model: CellModel, dialect: Dialect) -> Iterator[PlcVariable]:
    variables = len(model.variables)

    def named(kind: str) -> TypeName:
        return own(f"{model.prefix}_{kind.capitalize()}") if dialect.enumerations else elementary("INT")

    quality = named("quality")
    yield PlcVariable("alive", elementary("BOOL"), "the heartbeat of the gateway is heard")
    yield PlcVariable(
        "right_mapping", elementary("BOOL"), "its mapping is the one for which this program was made"
    )
    yield PlcVariable("trusted", elementary("BOOL"), "both: values may be used and written")
    yield PlcVariable(
        "wrong_mapping", elementary("BOOL"), "alive, but with another mapping: make these files anew"
    )
    yield PlcVariable("values_fresh", elementary("BOOL"), "the robot's values are fresh")
    yield PlcVariable("robot_writable", elementary("BOOL"), "writes reach the robot")
    yield PlcVariable("all_good", elementary("BOOL"), "every variable is good")
    yield PlcVariable("lock_owned", elementary("BOOL"), "somebody owns something")
    yield PlcVariable("watchdog_fed", elementary("BOOL"), "the watchdog of the robot program is fed")
    yield PlcVariable("fingerprint", elementary("DWORD"), "of the gateway's mapping")
    yield PlcVariable("robot_state", named("robot"), "the robot as a source of values")
    yield PlcVariable("program_state", named("program"), "state of the robot program")
    yield PlcVariable(
        "robot_age", elementary("UDINT"), "ms since the newest package of the robot; 16#FFFFFFFF: not known"
    )
    yield PlcVariable(
        "refusals", elementary("UDINT"), "requests refused since the gateway started, of all writers"
    )
    yield PlcVariable("refused_now", elementary("BOOL"), "one cycle long: something was refused")
    yield PlcVariable("refusal", named("refusal"), "why the last request was refused")
    yield PlcVariable("refusal_variable", elementary("UINT"), "number of the variable")
    yield PlcVariable("refusal_writer", elementary("UINT"), "who was refused, 255: the local operator")
    yield PlcVariable("refusal_holder", elementary("UINT"), "who held it, 255: the local operator")
    yield PlcVariable("good", array("BOOL", variables, first=1), "by number: the value may be used")
    yield PlcVariable("quality", array(quality.name, variables, first=1, is_own=quality.is_own), "by number")
    listed = ", ".join(f"{number} {name}" for number, name in enumerate(model.writers, 1))
    owners = f"by number: 0 nobody, {listed}, 255 the local operator" if listed else "by number"
    yield PlcVariable("owner", array("UINT", variables, first=1), owners)
