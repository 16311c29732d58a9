"""C99 for soft PLCs and test benches: one header with two functions, and nothing else that it needs.

The arithmetic is the gateway's own, in `double`, halves rounded to even. The header is what the tests compile and run
against a gateway: the tables of all targets are the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.header import header, overview, plan_lines
from gatewayd.links.modbus_server.plc.keywords import C
from gatewayd.links.modbus_server.plc.model import Encoding, PlcModel, Poll, Tag, TagFamily
from gatewayd.links.modbus_server.plc.names import Holds
from gatewayd.links.modbus_server.plc.st.types import description, meanings
from gatewayd.modbus.codec import TYPES

HOLDS: Final = Holds("C", 63, C)
_TYPES: Final = {
    "BOOL": "bool",
    "SINT": "int8_t",
    "USINT": "uint8_t",
    "INT": "int16_t",
    "UINT": "uint16_t",
    "DINT": "int32_t",
    "UDINT": "uint32_t",
    "LINT": "int64_t",
    "ULINT": "uint64_t",
    "REAL": "float",
    "LREAL": "double",
}
_ORDERS: Final = {"ABCD": (0, 0), "CDAB": (1, 0), "BADC": (0, 1), "DCBA": (1, 1)}
"""Whether the words are reversed, and whether the bytes of each are exchanged."""
_HELPERS: Final = """\
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

static inline float {p}_float(uint64_t bits)
{{
    uint32_t low = (uint32_t)bits;
    float number;
    memcpy(&number, &low, sizeof number);
    return number;
}}

static inline double {p}_double(uint64_t bits)
{{
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}}

static inline uint64_t {p}_float_bits(double wide)
{{
    float number = isfinite(wide) && fabs(wide) > FLT_MAX ? (float)copysign(FLT_MAX, wide) : (float)wide;
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}}

static inline uint64_t {p}_double_bits(double number)
{{
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}}

/* The nearest whole number, halves to even; what lies beyond low and high is these, NaN is 0. */
static inline int64_t {p}_nearest(double raw, int64_t low, int64_t high)
{{
    return isnan(raw) ? 0 : raw <= (double)low ? low : raw >= (double)high ? high : (int64_t)rint(raw);
}}

static inline uint64_t {p}_nearest_unsigned(double raw, uint64_t high)
{{
    return isnan(raw) || raw <= 0 ? 0 : raw >= (double)high ? high : (uint64_t)rint(raw);
}}
"""


def files(model: PlcModel) -> Iterator[ExportedFile]:
    """The header."""
    yield ExportedFile(f"{model.prefix.lower()}.h", "\n".join(_lines(model)) + "\n")


def _lines(model: PlcModel) -> Iterator[str]:
    prefix = model.prefix.lower()
    for line in (*header(model, "C"), *overview(model), *plan_lines(model)):
        yield _comment(line)
    yield f"#ifndef {model.prefix.upper()}_H"
    yield f"#define {model.prefix.upper()}_H"
    yield from (
        "",
        *(f"#include <{name}.h>" for name in ("float", "math", "stdbool", "stdint", "string")),
        "",
    )
    yield f"#define {model.prefix.upper()}_FINGERPRINT UINT32_C(0x{model.fingerprint:08X})"
    for kind, named in meanings().items():
        yield ""
        names = ", ".join(f"{model.prefix.upper()}_{kind.upper()}_{name.upper()}" for name, _text in named)
        yield f"enum {prefix}_{kind} {{ {names} }};"
    yield from _structure(prefix, "inputs", model.inputs)
    yield from _structure(prefix, "outputs", model.outputs)
    yield from ("", f"struct {prefix}_image {{")
    for poll in model.polls:
        kind = "bool" if poll.area.of_bits else "uint16_t"
        yield f"    {kind} {poll.name}[{poll.count}]; {_comment(poll.what)}"
    yield from ("};", "", _HELPERS.format(p=prefix))
    yield from _functions(model, prefix)
    yield from ("", "#endif")


def _structure(prefix: str, name: str, members: tuple[TagFamily, ...]) -> Iterator[str]:
    if members:
        yield from ("", f"struct {prefix}_{name} {{")
        for member in members:
            size = f"[{len(member.tags)}]" if member.is_array else ""
            yield f"    {_type_of(member.tags[0])} {member.name}{size}; {_comment(description(member))}"
        yield "};"


def _type_of(tag: Tag) -> str:
    """A scaled real is a `double`, however few steps it has."""
    return "double" if tag.arithmetic else _TYPES[tag.type]


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


def _read(tag: Tag, poll: Poll, prefix: str) -> str:
    place = f"image->{poll.name}"
    index = tag.address - poll.address
    if tag.encoding is None:
        return f"{place}[{index}]" if poll.area.of_bits else f"({place}[{index}] >> {tag.bit} & 1) != 0"
    raw = _raw(tag, tag.encoding, f"{place} + {index}", prefix)
    if tag.type == "BOOL":
        return f"{raw} != 0"
    if not tag.arithmetic:
        return raw
    return f"{raw} * {_real(tag.encoding.scale)} + {_real(tag.encoding.offset)}"


def _raw(tag: Tag, encoding: Encoding, place: str, prefix: str) -> str:
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


def _register(place: str, index: int, tags: Iterator[Tag], prefix: str) -> Iterator[str]:
    for position, tag in enumerate(tags):
        if tag.encoding is None and tag.bit is None:
            yield f"{place}[{index}] = inputs->{tag.path};"
        elif tag.bit is None:
            assert tag.encoding is not None
            reverse, swapped = _order(tag.encoding)
            words = TYPES[tag.encoding.type].words
            yield f"{prefix}_put({place} + {index}, {words}, {reverse}, {swapped}, {_bits(tag, tag.encoding, prefix)});"
        else:
            sign = "|=" if position else "="
            part = (
                f"inputs->{tag.path}"
                if tag.encoding is None
                else f"(uint8_t){_bits(tag, tag.encoding, prefix)}"
            )
            yield f"{place}[{index}] {sign} (uint16_t)({part} << {tag.bit});"


def _bits(tag: Tag, encoding: Encoding, prefix: str) -> str:
    number = TYPES[encoding.type]
    value = f"inputs->{tag.path}"
    scaled = (
        f"({value} - {_real(encoding.offset)}) / {_real(encoding.scale)}" if encoding.is_scaled else value
    )
    if number.is_real:
        return f"{prefix}_{'float' if number.words == 2 else 'double'}_bits({scaled})"
    if not encoding.is_scaled:
        return f"(uint64_t){value}"
    if number.low == 0:
        return f"{prefix}_nearest_unsigned({scaled}, UINT64_C({int(number.high)}))"
    low = "INT64_MIN" if number.size == 8 else f"INT64_C({int(number.low)})"
    return f"(uint64_t){prefix}_nearest({scaled}, {low}, INT64_C({int(number.high)}))"


def _real(number: float) -> str:
    """Every digit that it needs, exactly."""
    return f"({float(number)!r})"


def _comment(text: str) -> str:
    return f"/* {text.replace('*/', '* /')} */"
