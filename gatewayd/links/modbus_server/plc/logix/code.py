"""Structured text of Logix controllers: numbers are copied bit by bit (COP), registers are INT, bits are `word.3`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Final

from gatewayd.core.status_layout import HEADER_WORDS, LAYOUT_VERSION
from gatewayd.links.modbus_server.plc.model import WORD_BITS, PlcModel, Poll, RegisterTag
from gatewayd.links.registry import status_fields
from gatewayd.modbus.codec import TYPES
from gatewayd.plc.model import Encoding, initial
from gatewayd.plc.numbers import NUMBERS
from gatewayd.plc.st.types import meanings

_SWAPPED: Final = frozenset({"BADC", "DCBA"})
_REVERSED: Final = frozenset({"CDAB", "DCBA"})
_LARGEST: Final = {"int64": 9223372036854774784.0, "uint64": 18446744073709549568.0}
_NUMBERS: Final = {
    "robot_state": "robot_state",
    "program_state": "program",
    "refusal": "refusal_reason",
    "refusal_variable": "refusal_variable",
    "refusal_writer": "refusal_writer",
    "refusal_holder": "refusal_holder",
}
"""Member of the status -> word of the status block."""
_PATIENCE: Final = 1000
"""Milliseconds without a heartbeat after which the gateway counts as lost."""


def unpack(model: PlcModel) -> Iterator[str]:
    """Registers to values of the robot."""
    prefix = model.prefix
    yield f"IF {prefix}_Status.trusted THEN"
    for poll in model.reads:
        for tag in poll.tags:
            yield from (f"  {line}" for line in _read(tag, poll, prefix))
    yield "ELSE"
    for member in model.outputs:
        for lost in member.tags:
            value = initial(lost)
            if value is not None:
                number = repr(float(value)) if lost.type in ("REAL", "LREAL") else str(int(value))
                yield f"  {prefix}_Outputs.{lost.path} := {number};"
    yield "END_IF;"


def pack(model: PlcModel) -> Iterator[str]:
    """Values for the robot to registers."""
    prefix = model.prefix
    yield f"{prefix}_Clipped := 0;"
    for poll in model.writes:
        for address, tags in groupby(poll.tags, key=lambda tag: tag.address):
            for tag in tags:
                yield from _write(tag, f"{prefix}_Image.{poll.name}", address - poll.address, prefix)


def _place(poll_array: str, index: int, count: int, encoding: Encoding) -> list[str]:
    """Registers of a number, the least significant first, as the controller has them in memory."""
    places = [f"{poll_array}[{index + offset}]" for offset in range(count)]
    return places if encoding.order in _REVERSED else places[::-1]


def _read(tag: RegisterTag, poll: Poll, prefix: str) -> Iterator[str]:
    target, index = f"{prefix}_Outputs.{tag.path}", tag.address - poll.address
    array = f"{prefix}_Image.{poll.name}"
    if tag.encoding is None:
        yield f"{target} := {array}[{index}]{'' if poll.area.of_bits else f'.{tag.bit}'};"
        return
    number, wire = TYPES[tag.encoding.type], NUMBERS[tag.encoding.type].type
    is_whole = tag.type != "BOOL" and not tag.arithmetic
    raw = target if is_whole else f"{prefix}_{_raw_type(wire)}"
    if number.is_byte:
        yield f"COP({array}[{index}], {prefix}_Bytes[0], 2);"
        yield f"COP({prefix}_Bytes[{(tag.bit or 0) // 8}], {raw}, 1);"
    else:
        swapped = tag.encoding.order in _SWAPPED and number.name != "bool"
        for position, place in enumerate(_place(array, index, number.words, tag.encoding)):
            copied = f"{prefix}_Words[{position}]"
            yield f"SWPB({place}, REVERSE, {copied});" if swapped else f"{copied} := {place};"
        yield f"COP({prefix}_Words[0], {raw}, 1);"
    if tag.type == "BOOL":
        yield f"{target} := {raw} <> 0;"
    elif not is_whole:
        yield f"{target} := {raw} * {tag.encoding.scale!r} + {tag.encoding.offset!r};"


def _raw_type(wire: str) -> str:
    """A truth is read as the number that it is in the register."""
    return "INT" if wire == "BOOL" else wire


def _write(tag: RegisterTag, array: str, index: int, prefix: str) -> Iterator[str]:
    source = f"{prefix}_Inputs.{tag.path}"
    if tag.encoding is None:
        yield f"{array}[{index}]{'' if tag.bit is None else f'.{tag.bit}'} := {source};"
        return
    number, wire = TYPES[tag.encoding.type], NUMBERS[tag.encoding.type].type
    raw = source
    if tag.arithmetic or tag.type == "BOOL":
        raw = f"{prefix}_{_raw_type(wire)}"
        yield from _raw(tag, tag.encoding, source, raw, prefix)
    if number.is_byte:
        yield f"COP({array}[{index}], {prefix}_Bytes[0], 2);"
        yield f"COP({raw}, {prefix}_Bytes[{(tag.bit or 0) // 8}], 1);"
        yield f"COP({prefix}_Bytes[0], {array}[{index}], 1);"
        return
    yield f"COP({raw}, {prefix}_Words[0], {number.words});"
    swapped = tag.encoding.order in _SWAPPED and number.name != "bool"
    for position, place in enumerate(_place(array, index, number.words, tag.encoding)):
        copied = f"{prefix}_Words[{position}]"
        yield f"SWPB({copied}, REVERSE, {place});" if swapped else f"{place} := {copied};"


def _raw(tag: RegisterTag, encoding: Encoding, source: str, raw: str, prefix: str) -> Iterator[str]:
    """The raw number; an assignment rounds to the nearest, halves to even."""
    if tag.type == "BOOL":
        yield f"{raw} := {source};"
        return
    value = f"{prefix}_{tag.arithmetic}_Value"
    yield f"{value} := ({source} - {encoding.offset!r}) / {encoding.scale!r};"
    number = TYPES[encoding.type]
    if not number.is_real:
        for sign, end in ((">", _LARGEST.get(encoding.type, number.high)), ("<", number.low)):
            yield f"IF {value} {sign} {float(end)!r} THEN {value} := {float(end)!r}; {prefix}_Clipped := 1; END_IF;"
    yield f"{raw} := {value};"


def watch(model: PlcModel) -> Iterator[str]:
    """The status block."""
    prefix = model.prefix
    status, beat = f"{prefix}_Status", _word(model, "heartbeat")
    yield f"{prefix}_Silence.PRE := {_PATIENCE};"
    yield f"{prefix}_Silence.TimerEnable := {prefix}_Started AND ({beat} = {prefix}_Last_Beat);"
    yield f"TONR({prefix}_Silence);"
    yield f"IF {prefix}_Started AND ({beat} <> {prefix}_Last_Beat) THEN"
    yield f"  {status}.alive := 1;"
    yield f"ELSIF {prefix}_Silence.DN OR NOT {prefix}_Started THEN"
    yield f"  {status}.alive := 0;"
    yield "END_IF;"
    yield f"{prefix}_Started := 1;"
    yield f"{prefix}_Last_Beat := {beat};"
    yield from _double(model, "fingerprint", f"{status}.fingerprint")
    signed = model.fingerprint - (1 << 32) if model.fingerprint >> 31 else model.fingerprint
    layout = f"{_word(model, 'layout')} = {LAYOUT_VERSION}"
    yield f"{status}.right_mapping := ({layout}) AND ({status}.fingerprint = {signed});"
    yield f"{status}.wrong_mapping := {status}.alive AND NOT {status}.right_mapping;"
    yield f"{status}.trusted := {status}.alive AND {status}.right_mapping;"
    for bit, name in ((0, "values_fresh"), (1, "robot_writable"), (2, "all_good"), (6, "watchdog_fed")):
        yield f"{status}.{name} := {status}.trusted AND {_word(model, 'flags')}.{bit};"
    for name, word in _NUMBERS.items():
        yield f"{status}.{name} := {_word(model, word)};"
    yield f"IF NOT {status}.trusted THEN"
    for name in ("robot", "program"):
        yield f"  {status}.{name}_state := {_unknown(name)};"
    yield "END_IF;"
    yield f"{prefix}_Last_Refusals := {status}.refusals;"
    yield from _double(model, "refused", f"{status}.refusals")
    yield f"{status}.refused_now := {status}.trusted AND ({status}.refusals <> {prefix}_Last_Refusals);"
    yield from _tables(model, status)


def _tables(model: PlcModel, status: str) -> Iterator[str]:
    for number in range(1, len(model.variables) + 1):
        array, index = model.array_of(HEADER_WORDS + (number - 1) // WORD_BITS)
        bit = f"{model.prefix}_Image.{array}[{index}].{(number - 1) % WORD_BITS}"
        yield f"{status}.good[{number}] := {status}.trusted AND {bit};"
    first = {"quality": 1, "owner": 1}
    for poll in model.status:
        for table, number in first.items():
            if poll.slow and table in poll.what:
                yield f"COP({model.prefix}_Image.{poll.name}[0], {status}.{table}[{number}], {poll.count});"
                first[table] += poll.count
    yield f"IF NOT {status}.trusted THEN"
    yield f"  FOR {model.prefix}_N := 1 TO {len(model.variables)} DO"
    yield f"    {status}.quality[{model.prefix}_N] := {_unknown('quality')};"
    yield "  END_FOR;"
    yield "END_IF;"


def _unknown(kind: str) -> int:
    """The number that says that a number of the status block is not known."""
    return [name for name, _text in meanings()[kind]].index("unknown")


def _word(model: PlcModel, name: str, more: int = 0) -> str:
    offset = next(field.offset for field in status_fields() if field.name == name)
    array, index = model.array_of(offset + more)
    return f"{model.prefix}_Image.{array}[{index}]"


def _double(model: PlcModel, name: str, target: str) -> Sequence[str]:
    words = f"{model.prefix}_Words"
    return (
        f"{words}[0] := {_word(model, name, 1)};",
        f"{words}[1] := {_word(model, name)};",
        f"COP({words}[0], {target}, 1);",
    )
