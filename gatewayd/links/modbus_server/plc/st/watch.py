"""The status block decoded and watched: is the gateway alive, is its mapping the right one, what was refused."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.status_layout import HEADER_WORDS, LAYOUT_VERSION
from gatewayd.links.modbus_server.plc.model import WORD_BITS, PlcModel
from gatewayd.links.registry import status_fields
from gatewayd.plc.st.dialect import Dialect, elementary, own, word
from gatewayd.plc.st.naming import FLAGS, name_of, trusted_name
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection, indented

_GOOD = HEADER_WORDS
"""Offset of the table of good variables."""


def watch(model: PlcModel, dialect: Dialect) -> ProgramUnit:
    """The block for the status. It needs no other sign than the image: a heartbeat that stands still says all."""
    body = [*_liveness(model, dialect), *_numbers(model, dialect), *_tables(model, dialect)]
    prefix = model.prefix
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{prefix}_Watch",
        (
            VariableSection(
                "VAR_INPUT",
                (
                    PlcVariable(
                        "patience",
                        elementary("TIME"),
                        "without a heartbeat the gateway counts as lost",
                        "T#1s",
                    ),
                ),
            ),
            VariableSection(
                "VAR_IN_OUT",
                (
                    PlcVariable("image", own(f"{prefix}_Image")),
                    PlcVariable("status", own(f"{prefix}_Status")),
                ),
            ),
            VariableSection(
                "VAR",
                (
                    PlcVariable("silence", elementary("TON")),
                    PlcVariable("last_beat", elementary("WORD")),
                    PlcVariable("last_refusals", elementary("UDINT")),
                    PlcVariable("started", elementary("BOOL")),
                    PlcVariable("known", elementary("BOOL"), "the count of refusals"),
                    PlcVariable("n", elementary("INT")),
                ),
            ),
        ),
        tuple(body),
        comment="the status block of the gateway",
    )


def _word(model: PlcModel, name: str, more: int = 0) -> str:
    """A word of the header in the image."""
    offset = next(field.offset for field in status_fields() if field.name == name)
    array, index = model.array_of(offset + more)
    return f"image.{array}[{index}]"


def _double(model: PlcModel, dialect: Dialect, name: str) -> str:
    return dialect.call(model, "Double", high=_word(model, name), low=_word(model, name, 1))


def _liveness(model: PlcModel, dialect: Dialect) -> Iterator[str]:
    beat = _word(model, "heartbeat")
    yield f"silence(IN := started AND ({beat} = last_beat), PT := patience);"
    yield f"IF started AND ({beat} <> last_beat) THEN"
    yield "  status.alive := TRUE;"
    yield "ELSIF silence.Q OR NOT started THEN"
    yield "  status.alive := FALSE;"
    yield "END_IF;"
    yield "started := TRUE;"
    yield f"last_beat := {beat};"
    yield f"status.fingerprint := {_double(model, dialect, 'fingerprint')};"
    yield f"status.right_mapping := ({_word(model, 'layout')} = {word(LAYOUT_VERSION)})"
    yield f"  AND (status.fingerprint = DWORD#16#{model.fingerprint:08X});"
    yield "status.wrong_mapping := status.alive AND NOT status.right_mapping;"
    yield "status.trusted := status.alive AND status.right_mapping;"


def _numbers(model: PlcModel, dialect: Dialect) -> Iterator[str]:
    flags = _word(model, "flags")
    for bit, name in FLAGS.items():
        yield f"status.{name} := status.trusted AND (({flags} AND {word(1 << bit)}) <> {word(0)});"
    yield from trusted_name("robot_state", _word(model, "robot_state"), "robot", model, dialect)
    yield from trusted_name("program_state", _word(model, "program"), "program", model, dialect)
    yield f"status.robot_age := DWORD_TO_UDINT({_double(model, dialect, 'robot_age')});"
    yield "IF NOT status.trusted THEN"
    yield "  status.robot_age := UDINT#4294967295;"
    yield "END_IF;"
    yield f"status.refusals := DWORD_TO_UDINT({_double(model, dialect, 'refused')});"
    yield "status.refused_now := status.trusted AND known AND (status.refusals <> last_refusals);"
    yield "known := status.trusted;"
    yield "last_refusals := status.refusals;"
    yield from name_of("refusal", _word(model, "refusal_reason"), "refusal", model, dialect)
    for name in ("refusal_variable", "refusal_writer", "refusal_holder"):
        yield f"status.{name} := WORD_TO_UINT({_word(model, name)});"


def _tables(model: PlcModel, dialect: Dialect) -> Iterator[str]:
    count = len(model.variables)
    array, index = model.array_of(_GOOD)
    shifted = dialect.shift(
        "SHR", f"image.{array}[{index} + (n - 1) / {WORD_BITS}]", dialect.bit_of(f"(n - 1) MOD {WORD_BITS}")
    )
    yield f"FOR n := 1 TO {count} DO"
    yield f"  status.good[n] := status.trusted AND (({shifted} AND {word(1)}) <> {word(0)});"
    yield "END_FOR;"
    first = {"quality": 1, "owner": 1}
    for poll in model.status:
        for table, number in first.items():
            if poll.slow and table in poll.what:
                yield f"FOR n := {number} TO {number + poll.count - 1} DO"
                place = f"image.{poll.name}[n - {number}]"
                yield from indented(list(_entry(table, place, model, dialect)))
                yield "END_FOR;"
                first[table] += poll.count


def _entry(table: str, place: str, model: PlcModel, dialect: Dialect) -> Iterator[str]:
    """What a table has of variable n."""
    if table == "owner":
        yield f"status.owner[n] := WORD_TO_UINT({place});"
    else:
        yield from trusted_name("quality[n]", place, "quality", model, dialect)
