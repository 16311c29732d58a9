"""C99 for soft PLCs and test benches: one header with two functions, and nothing else that it needs.

The arithmetic is the gateway's own, in `double`, halves rounded to even. The header is what the tests compile and run
against a gateway: the tables of all targets are the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.model import PlcModel, Poll, RegisterTag
from gatewayd.links.modbus_server.plc.polling import plan_lines
from gatewayd.modbus.codec import TYPES
from gatewayd.plc.c import HELPERS, bits_of, comment, enumerations, structure, value_of
from gatewayd.plc.header import header, overview
from gatewayd.plc.keywords import C
from gatewayd.plc.model import Encoding
from gatewayd.plc.names import Holds

HOLDS: Final = Holds("C", 63, C)
_ORDERS: Final = {"ABCD": (0, 0), "CDAB": (1, 0), "BADC": (0, 1), "DCBA": (1, 1)}
"""Whether the words are reversed, and whether the bytes of each are exchanged."""
_WORDS: Final = """\
static inline uint64_t {p}_get(const uint16_t *word, int count, int reversed, int swapped)
{{
    uint64_t number = 0;
    for (int i = 0; i < count; i++) {{
        uint16_t each = word[reversed ? count - 1 - i : i];
        number = number << 16 | (swapped ? (uint16_t)(each << 8 | each >> 8) : each);
    }}
    return number;
}}

static inline void {p}_put(uint16_t *word, int count, int reversed, int swapped, uint64_t number)
{{
    for (int i = count - 1; i >= 0; i--, number >>= 16) {{
        uint16_t each = (uint16_t)number;
        word[reversed ? count - 1 - i : i] = swapped ? (uint16_t)(each << 8 | each >> 8) : each;
    }}
}}

"""


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """The header."""
    yield ExportedFile(f"{model.prefix.lower()}.h", "\n".join(_lines(model)) + "\n")


def _lines(model: PlcModel) -> Iterator[str]:
    prefix = model.prefix.lower()
    for line in (*header(model, "C"), *overview(model), *plan_lines(model)):
        yield comment(line)
    yield f"#ifndef {model.prefix.upper()}_H"
    yield f"#define {model.prefix.upper()}_H"
    yield from (
        "",
        *(f"#include <{name}.h>" for name in ("float", "math", "stdbool", "stdint", "string")),
        "",
    )
    yield f"#define {model.prefix.upper()}_FINGERPRINT UINT32_C(0x{model.fingerprint:08X})"
    yield from enumerations(prefix)
    yield from structure(prefix, "inputs", model.inputs)
    yield from structure(prefix, "outputs", model.outputs)
    yield from ("", f"struct {prefix}_image {{")
    for poll in model.polls:
        kind = "bool" if poll.area.of_bits else "uint16_t"
        yield f"    {kind} {poll.name}[{poll.count}]; {comment(poll.what)}"
    yield from ("};", "", _WORDS.format(p=prefix) + HELPERS.format(p=prefix))
    yield from _functions(model, prefix)
    yield from ("", "#endif")


def _functions(model: PlcModel, prefix: str) -> Iterator[str]:
    image = f"struct {prefix}_image *image"
    if model.outputs:
        yield f"static inline void {prefix}_unpack(const {image}, struct {prefix}_outputs *outputs)"
        yield "{"
        for poll in model.reads:
            for tag in poll.tags:
                yield f"    outputs->{tag.path} = {_read(tag, poll, prefix)};"
        yield "}"
    if model.outputs and model.inputs:
        yield ""
    if model.inputs:
        yield f"static inline void {prefix}_pack(const struct {prefix}_inputs *inputs, {image})"
        yield "{"
        for poll in model.writes:
            array = f"image->{poll.name}"
            for address, tags in groupby(poll.tags, key=lambda tag: tag.address):
                for line in _register(array, address - poll.address, tags, prefix):
                    yield f"    {line}"
        yield "}"


def _read(tag: RegisterTag, poll: Poll, prefix: str) -> str:
    place = f"image->{poll.name}"
    index = tag.address - poll.address
    if tag.encoding is None:
        return f"{place}[{index}]" if poll.area.of_bits else f"({place}[{index}] >> {tag.bit} & 1) != 0"
    return value_of(_raw(tag, tag.encoding, f"{place} + {index}", prefix), tag)


def _raw(tag: RegisterTag, encoding: Encoding, place: str, prefix: str) -> str:
    number = TYPES[encoding.type]
    reverse, swapped = _order(encoding)
    bits = f"{prefix}_get({place}, {number.words}, {reverse}, {swapped})"
    if number.is_real:
        return f"{prefix}_{'float' if number.words == 2 else 'double'}({bits})"
    if number.is_byte:
        bits = f"({bits} >> {tag.bit or 0})"
    kind = "uint16_t" if encoding.type == "bool" else f"{encoding.type}_t"
    return f"({kind}){bits}"


def _order(encoding: Encoding) -> tuple[int, int]:
    number = TYPES[encoding.type]
    reverse, swapped = _ORDERS[encoding.order]
    return reverse, swapped if number.size > 1 and number.name != "bool" else 0


def _register(place: str, index: int, tags: Iterator[RegisterTag], prefix: str) -> Iterator[str]:
    for position, tag in enumerate(tags):
        if tag.encoding is None and tag.bit is None:
            yield f"{place}[{index}] = inputs->{tag.path};"
        elif tag.bit is None:
            assert tag.encoding is not None
            reverse, swapped = _order(tag.encoding)
            words = TYPES[tag.encoding.type].words
            bits = bits_of(tag, tag.encoding, prefix)
            yield f"{prefix}_put({place} + {index}, {words}, {reverse}, {swapped}, {bits});"
        else:
            sign = "|=" if position else "="
            part = (
                f"inputs->{tag.path}"
                if tag.encoding is None
                else f"(uint8_t){bits_of(tag, tag.encoding, prefix)}"
            )
            yield f"{place}[{index}] {sign} (uint16_t)({part} << {tag.bit});"
