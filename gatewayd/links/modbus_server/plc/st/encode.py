"""From values to registers: what lies in one register together is put together first."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from itertools import groupby

from gatewayd.links.modbus_server.plc.model import PlcModel, Poll, RegisterTag
from gatewayd.modbus.codec import TYPES
from gatewayd.plc.numbers import NUMBERS, REALS
from gatewayd.plc.st.dialect import Dialect, elementary, own, word
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection, used
from gatewayd.plc.st.scaling import SCRATCH, raw_of

_SWAPPED = frozenset({"BADC", "DCBA"})
_REVERSED = frozenset({"CDAB", "DCBA"})


def pack(model: PlcModel, dialect: Dialect) -> ProgramUnit:
    """The block that brings the structure of inputs into the registers that are written."""
    prefix = model.prefix
    lines = ["clipped := FALSE;"]
    for poll in model.writes:
        for address, tags in groupby(poll.tags, key=lambda tag: tag.address):
            lines += _register(address - poll.address, list(tags), poll, model, dialect)
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{prefix}_Pack",
        (
            VariableSection(
                "VAR_OUTPUT",
                (
                    PlcVariable(
                        "clipped", elementary("BOOL"), "a value was NaN, or beyond what its register can hold"
                    ),
                ),
            ),
            VariableSection(
                "VAR_IN_OUT",
                (
                    PlcVariable("inputs", own(f"{prefix}_Inputs")),
                    PlcVariable("image", own(f"{prefix}_Image")),
                ),
            ),
            VariableSection("VAR", used(lines, *SCRATCH)),
        ),
        tuple(lines),
        comment="values for the robot to registers",
    )


def _register(
    index: int, tags: Sequence[RegisterTag], poll: Poll, model: PlcModel, dialect: Dialect
) -> Iterator[str]:
    place = f"image.{poll.name}[{index}]"
    first = tags[0]
    if first.bit is None and first.encoding is None:
        yield f"{place} := inputs.{first.path};"
    elif first.bit is None:
        yield from _number(index, first, poll, model, dialect)
    else:
        yield f"value := {word(0)};"
        for tag in tags:
            yield from _part(tag, dialect)
        yield f"{place} := value;"


def _part(tag: RegisterTag, dialect: Dialect) -> Iterator[str]:
    """A bit or a byte of the register that is being put together in `value`."""
    if tag.encoding is None or tag.type == "BOOL":
        yield f"IF inputs.{tag.path} THEN value := value OR {word(1 << (tag.bit or 0))}; END_IF;"
        return
    raw = yield from raw_of(tag, tag.encoding)
    byte = f"BYTE_TO_WORD({NUMBERS[tag.encoding.type].type}_TO_BYTE({raw}))"
    yield f"value := value OR {dialect.shift('SHL', byte, '8') if tag.bit else byte};"


def _number(index: int, tag: RegisterTag, poll: Poll, model: PlcModel, dialect: Dialect) -> Iterator[str]:
    encoding = tag.encoding
    assert encoding is not None
    wire, count = NUMBERS[encoding.type].type, TYPES[encoding.type].words
    places = [f"image.{poll.name}[{index + offset}]" for offset in range(count)]
    if encoding.order in _REVERSED:
        places.reverse()
    turned = encoding.order in _SWAPPED and encoding.type != "bool"
    if tag.type == "BOOL":
        words = yield from _truth(tag, wire, count)
    else:
        raw = yield from raw_of(tag, encoding)
        words = yield from _split(raw, wire, count, model, dialect)
    for place, each in zip(places, words, strict=True):
        yield f"{place} := {dialect.call(model, 'Swap', value=each) if turned else each};"


def _truth(tag: RegisterTag, wire: str, count: int) -> Generator[str, None, list[str]]:
    """TRUE is the number 1."""
    one = {"REAL": [0x3F80, 0], "LREAL": [0x3FF0, 0, 0, 0]}.get(wire, [0] * (count - 1) + [1])
    nonzero = next(number for number in one if number)
    yield f"value := {word(0)};"
    yield f"IF inputs.{tag.path} THEN value := {word(nonzero)}; END_IF;"
    return ["value" if number else word(0) for number in one]


def _split(
    raw: str, wire: str, count: int, model: PlcModel, dialect: Dialect
) -> Generator[str, None, list[str]]:
    """Words of a number, the most significant first."""
    if count == 1:
        return [f"{wire}_TO_WORD({raw})"]
    bits, kind = ("double", "DWORD") if count == 2 else ("quad", "LWORD")
    made = (
        dialect.call(model, f"From{wire.capitalize()}", value=raw)
        if wire in REALS
        else f"{wire}_TO_{kind}({raw})"
    )
    yield f"{bits} := {made};"
    shifts = [16 * place for place in reversed(range(count))]
    return [
        f"{kind}_TO_WORD({dialect.shift('SHR', bits, str(by)) if by else bits} AND {kind}#16#FFFF)"
        for by in shifts
    ]
