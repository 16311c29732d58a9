"""Studio 5000: data types and routines as L5X, tags as a table.

Logix controllers have no Modbus of their own. The client is an add-on instruction of Rockwell's, which is imported as a
rung with its tags; a routine tells these what to do. A cell that is too large for it has its transactions as comments.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.build import refuse_name
from gatewayd.links.modbus_server.plc.logix.client import (
    TooMuch,
    Transaction,
    client,
    client_tags,
    transactions,
)
from gatewayd.links.modbus_server.plc.logix.code import pack, unpack, watch
from gatewayd.links.modbus_server.plc.logix.handshake import MEMBERS, handshake
from gatewayd.links.modbus_server.plc.model import PlcModel, Poll
from gatewayd.links.modbus_server.plc.polling import plan_lines
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import LOGIX
from gatewayd.plc.logix.l5x import LogixMember, data_type, routine
from gatewayd.plc.logix.tags_csv import tags
from gatewayd.plc.model import TagFamily
from gatewayd.plc.names import Holds
from gatewayd.plc.st.types import description, meanings

_NEW_TYPES: Final = frozenset({"USINT", "UINT", "UDINT", "ULINT", "LINT", "LREAL"})
HOLDS: Final = Holds("Studio 5000", 40, LOGIX, _NEW_TYPES, "controllers older than the 5380 and 5580")
_PROGRAM: Final = "MainProgram"
_SCRATCH: Final = ("SINT", "INT", "DINT", "REAL")


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """In the order in which they are imported: data types, tags, routines. Raises ExportError for a host by name."""
    prefix = model.prefix
    about = "\n".join(header(model, "Studio 5000"))
    kinds = {
        "Inputs": [_member(family) for family in model.inputs],
        "Outputs": [_member(family) for family in model.outputs],
        "Image": list(_image(model)),
        "Status": list(_status(model)),
        "HandshakeType": list(MEMBERS) if model.inputs else [],
    }
    for name, members in kinds.items():
        if members:
            yield _file(f"{prefix}_{name}.L5X", data_type(f"{prefix}_{name}", about, members))
    present = [f"{prefix}_{name}" for name, members in kinds.items() if members]
    controller_tags = [LogixMember(name.removesuffix("Type"), name) for name in present]
    plan, why_not = _plan(model)
    if plan:
        refuse_name(model.host, "Rockwell's Modbus client")
    remarks = (*header(model, "tags"), *overview(model), *plan_lines(model))
    yield _file(
        f"{prefix}_Tags.csv", tags(remarks, (*controller_tags, *_scratch(model), *client_tags(model, plan)))
    )
    routines = {"Watch": watch(model), "Unpack": unpack(model) if model.outputs else ()}
    if model.inputs:
        routines["Pack"] = pack(model)
        routines["Handshake"] = handshake(model)
    if plan:
        routines["Client"] = client(model, plan)
    for name, lines in routines.items():
        yield _file(f"{prefix}_{name}.L5X", _routine(f"{prefix}_{name}", lines, about))
    yield _file(
        f"{prefix}_Main.L5X", _routine(f"{prefix}_Main", _main(model, why_not), beginning(model)), once=True
    )


def _file(name: str, text: str, *, once: bool = False) -> ExportedFile:
    return ExportedFile(name, text, line_end="\r\n", once=once)


def _routine(name: str, lines: Iterable[str], comment: str) -> str:
    return routine(name, _PROGRAM, tuple(lines), comment)


def _member(family: TagFamily) -> LogixMember:
    return LogixMember(
        family.name, family.type, len(family.tags) if family.is_array else 0, description(family)
    )


def _image(model: PlcModel) -> Iterator[LogixMember]:
    for poll in model.polls:
        kind = "BOOL" if poll.area.of_bits else "INT"
        text = f"FC {poll.function}, address {poll.address}, count {poll.count}: {poll.what}"
        yield LogixMember(poll.name, kind, poll.count, text)


def _status(model: PlcModel) -> Iterator[LogixMember]:
    listed = {
        kind: ", ".join(f"{number} {name}" for number, (name, _) in enumerate(named))
        for kind, named in meanings().items()
    }
    truths = {
        "alive": "the heartbeat of the gateway is heard",
        "right_mapping": "its mapping is the one for which this was made",
        "trusted": "both: values may be used and written",
        "wrong_mapping": "alive, but with another mapping: make these files anew",
        "values_fresh": "the robot's values are fresh",
        "robot_writable": "writes reach the robot",
        "all_good": "every variable is good",
        "watchdog_fed": "the watchdog of the robot program is fed",
        "refused_now": "one scan long: something was refused",
    }
    for name, text in truths.items():
        yield LogixMember(name, "BOOL", 0, text)
    yield LogixMember("fingerprint", "DINT", 0, "of the gateway's mapping")
    yield LogixMember("refusals", "DINT", 0, "requests refused since the gateway started, of all writers")
    yield LogixMember("robot_state", "INT", 0, listed["robot"])
    yield LogixMember("program_state", "INT", 0, listed["program"])
    yield LogixMember("refusal", "INT", 0, listed["refusal"])
    for name in ("refusal_variable", "refusal_writer", "refusal_holder"):
        yield LogixMember(name, "INT", 0, "number; 255: the local operator")
    count = len(model.variables) + 1
    yield LogixMember("good", "BOOL", count, "by number from 1: the value may be used")
    yield LogixMember("quality", "INT", count, f"by number from 1: {listed['quality']}")
    yield LogixMember("owner", "INT", count, "by number from 1: number of the writer, 0 nobody")


def _scratch(model: PlcModel) -> Iterator[LogixMember]:
    """Tags that the routines use, and the switch for writing."""
    prefix = model.prefix
    used = {
        tag.encoding.type for family in (*model.inputs, *model.outputs) for tag in family.tags if tag.encoding
    }
    wide = [kind for kind in sorted(_NEW_TYPES) if any(tag in used for tag in _WIRE_OF[kind])]
    for kind in (*_SCRATCH, *wide):
        yield LogixMember(f"{prefix}_{kind}", kind)
    arithmetics = {tag.arithmetic for family in model.inputs for tag in family.tags} - {""}
    for kind in sorted(arithmetics):
        yield LogixMember(f"{prefix}_{kind}_Value", kind)
    yield LogixMember(f"{prefix}_Words", "INT", 4)
    yield LogixMember(f"{prefix}_Bytes", "SINT", 2)
    yield LogixMember(f"{prefix}_Silence", "FBD_TIMER")
    yield LogixMember(f"{prefix}_Last_Beat", "INT")
    yield LogixMember(f"{prefix}_Last_Refusals", "DINT")
    yield LogixMember(f"{prefix}_N", "DINT")
    yield LogixMember(f"{prefix}_Started", "BOOL")
    yield LogixMember(f"{prefix}_Clipped", "BOOL", 0, "a value was beyond what its register can hold")
    yield LogixMember(f"{prefix}_Write", "BOOL", 0, "set it when the inputs hold what you want")


_WIRE_OF: Final = {
    "USINT": ("uint8",),
    "UINT": ("uint16",),
    "UDINT": ("uint32",),
    "ULINT": ("uint64",),
    "LINT": ("int64",),
    "LREAL": ("float64",),
}


def _plan(model: PlcModel) -> tuple[Sequence[Transaction], str]:
    """The transactions of the client; where it cannot hold them, none and the reason."""
    try:
        return transactions(model), ""
    except TooMuch as error:
        return (), str(error)


def _main(model: PlcModel, why_not: str) -> Iterator[str]:
    prefix = model.prefix
    if why_not:
        yield f"// Rockwell's client cannot hold this cell: {why_not}. Call another one here, for instance"
        yield "// that of a module, and copy what it has read into the arrays of the image:"
        yield from _listed(poll for poll in model.polls if not poll.writes)
    else:
        yield f"JSR({prefix}_Client);"
    yield f"JSR({prefix}_Watch);"
    if model.outputs:
        yield f"JSR({prefix}_Unpack);"
    yield "// your program: it reads the outputs, and writes the inputs"
    if model.inputs:
        yield f"JSR({prefix}_Pack);"
        if why_not:
            yield f"// Let it write only while {prefix}_Status.trusted AND {prefix}_Write; count in {prefix}_Written"
            yield "// the rounds in which all writes were confirmed:"
            yield from _listed(model.writes)


def _listed(polls: Iterable[Poll]) -> Iterator[str]:
    for poll in polls:
        yield f"// {poll.name}: FC {poll.function}, address {poll.address}, count {poll.count}"
