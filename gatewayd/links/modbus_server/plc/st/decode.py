"""From registers to values: one statement for each variable."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.modbus_server.plc.model import PlcModel, Poll, RegisterTag
from gatewayd.modbus.codec import TYPES
from gatewayd.plc.model import Encoding
from gatewayd.plc.numbers import NUMBERS
from gatewayd.plc.st.dialect import Dialect, elementary, own, word
from gatewayd.plc.st.program import (
    PlcVariable,
    ProgramUnit,
    VariableSection,
    indented,
    used,
)
from gatewayd.plc.st.scaling import JOINED, UNREADABLE, fallback, from_bits, value_of

_SWAPPED = frozenset({"BADC", "DCBA"})
_REVERSED = frozenset({"CDAB", "DCBA"})


def unpack(model: PlcModel, dialect: Dialect) -> ProgramUnit:
    """The block that brings the values of the robot into the structure of outputs."""
    prefix = model.prefix
    decoded = [
        line for poll in model.reads for tag in poll.tags for line in statement(tag, poll, model, dialect)
    ]
    lost = [line for member in model.outputs for tag in member.tags for line in fallback(tag)]
    if dialect.primitives.only_finite:
        decoded.insert(0, "unreadable := FALSE;")
    body = ["IF trusted THEN", *indented(decoded)]
    if lost:
        body += ["ELSE", *indented(lost)]
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{prefix}_Unpack",
        (
            VariableSection(
                "VAR_INPUT",
                (
                    PlcVariable(
                        "trusted",
                        elementary("BOOL"),
                        "from the status: otherwise each value is what on_stale says",
                    ),
                ),
            ),
            VariableSection("VAR_OUTPUT", (UNREADABLE,) if dialect.primitives.only_finite else ()),
            VariableSection(
                "VAR_IN_OUT",
                (
                    PlcVariable("image", own(f"{prefix}_Image")),
                    PlcVariable("outputs", own(f"{prefix}_Outputs")),
                ),
            ),
            VariableSection(
                "VAR",
                used(body, *JOINED),
            ),
        ),
        (*body, "END_IF;"),
        comment="registers to values of the robot",
    )


def statement(tag: RegisterTag, poll: Poll, model: PlcModel, dialect: Dialect) -> Iterator[str]:
    """What brings one value from the image."""
    target, index = f"outputs.{tag.path}", tag.address - poll.address
    place = f"image.{poll.name}[{index}]"
    if tag.encoding is None:
        packed = f"({place} AND {word(1 << (tag.bit or 0))}) <> {word(0)}"
        yield f"{target} := {place if poll.area.of_bits else packed};"
        return
    if TYPES[tag.encoding.type].words == 1:
        yield f"{target} := {value_of(_single(place, tag, tag.encoding, model, dialect), tag)};"
        return
    bits = "double" if TYPES[tag.encoding.type].words == 2 else "quad"
    yield f"{bits} := {_joined(poll, index, tag.encoding, model, dialect)};"
    yield from from_bits(target, bits, tag, model, dialect)


def _single(place: str, tag: RegisterTag, encoding: Encoding, model: PlcModel, dialect: Dialect) -> str:
    """The raw number of one register or of a byte of it."""
    number = TYPES[encoding.type]
    if number.is_byte:
        byte = dialect.shift("SHR", place, "8") if tag.bit else f"{place} AND {word(0xFF)}"
        return f"BYTE_TO_{NUMBERS[encoding.type].type}(WORD_TO_BYTE({byte}))"
    is_turned = encoding.order in _SWAPPED and encoding.type != "bool"
    turned = dialect.call(model, "Swap", value=place) if is_turned else place
    if encoding.type == "bool":
        return f"WORD_TO_UINT({turned})"
    return f"WORD_TO_{NUMBERS[encoding.type].type}({turned})"


def _joined(poll: Poll, index: int, encoding: Encoding, model: PlcModel, dialect: Dialect) -> str:
    count = TYPES[encoding.type].words
    words = [f"image.{poll.name}[{index + offset}]" for offset in range(count)]
    if encoding.order in _SWAPPED:
        words = [dialect.call(model, "Swap", value=each) for each in words]
    if encoding.order in _REVERSED:
        words.reverse()
    names = ("high", "low") if count == 2 else ("a", "b", "c", "d")
    return dialect.call(model, "Double" if count == 2 else "Quad", **dict(zip(names, words, strict=True)))
