"""The status words in TPDOs watched: is the gateway alive, is its mapping the right one, what was refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from gatewayd.core.image import Quality
from gatewayd.core.status_layout import LAYOUT_VERSION
from gatewayd.links.canopen_node.plc.content import Content
from gatewayd.links.canopen_node.plc.data import shared_data
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.plc.st.dialect import Dialect, elementary, word
from gatewayd.plc.st.naming import FLAGS, literal_of, name_of, trusted_name
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection, used
from gatewayd.plc.st.types import meanings

_ALWAYS: Final = frozenset({"alive", "right_mapping", "wrong_mapping", "trusted"})
OPERATIONAL: Final = PlcVariable(
    "operational", elementary("BOOL"), "the master says that the node is operational and not lost"
)


def present(model: PdoModel) -> frozenset[str]:
    """The members of the status for which TPDOs have words."""
    found = set(_ALWAYS)
    if model.word("fingerprint") is not None:
        found.add("fingerprint")
    for field, (members, _decode) in _DECODED.items():
        if model.word(field) is not None:
            found.update(members)
    if model.qualities:
        found.update(("good", "quality"))
    return frozenset(found)


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
            VariableSection("VAR_INPUT", (OPERATIONAL, *used(body, patience))),
            VariableSection("VAR_IN_OUT", shared_data(model, "from_node", "status")),
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
