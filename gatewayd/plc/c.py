"""C99: what the headers of all links have in common: structures, names of numbers, and the arithmetic of a value.

The arithmetic is the gateway's own, in `double`, halves rounded to even.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.plc.model import Encoding, Tag, TagFamily
from gatewayd.plc.numbers import NUMBERS
from gatewayd.plc.st.types import description, meanings

TYPES: Final = {
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
"""Elementary type -> type in C."""
HELPERS: Final = """\
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
"""Functions with `{p}` for the prefix: reals from their bits and back, and the nearest whole number."""


def enumerations(prefix: str) -> Iterator[str]:
    """The names of numbers in the status block."""
    for kind, named in meanings().items():
        yield ""
        names = ", ".join(f"{prefix.upper()}_{kind.upper()}_{name.upper()}" for name, _text in named)
        yield f"enum {prefix}_{kind} {{ {names} }};"


def structure(prefix: str, name: str, members: tuple[TagFamily, ...]) -> Iterator[str]:
    """Inputs or outputs."""
    if members:
        yield from ("", f"struct {prefix}_{name} {{")
        for member in members:
            size = f"[{len(member.tags)}]" if member.is_array else ""
            yield f"    {type_of(member.tags[0])} {member.name}{size}; {comment(description(member))}"
        yield "};"


def type_of(tag: Tag) -> str:
    """A scaled real is a `double`, however few steps it has."""
    return "double" if tag.arithmetic else TYPES[tag.type]


def value_of(raw: str, tag: Tag) -> str:
    """The raw number with scale and offset, as the type of the value."""
    encoding = tag.encoding
    if encoding is None:
        return raw
    if tag.type == "BOOL":
        return f"{raw} != 0"
    if not tag.arithmetic:
        return raw
    return f"{raw} * {_real(encoding.scale)} + {_real(encoding.offset)}"


def bits_of(tag: Tag, encoding: Encoding, prefix: str) -> str:
    """The raw number of a value as unsigned bits: the nearest that its type can hold."""
    number = NUMBERS[encoding.type]
    value = f"inputs->{tag.path}"
    scaled = (
        f"({value} - {_real(encoding.offset)}) / {_real(encoding.scale)}" if encoding.is_scaled else value
    )
    if number.is_real:
        return f"{prefix}_{'float' if number.size == 4 else 'double'}_bits({scaled})"
    if not encoding.is_scaled:
        return f"(uint64_t){value}"
    if number.low == 0:
        return f"{prefix}_nearest_unsigned({scaled}, UINT64_C({int(number.high)}))"
    low = "INT64_MIN" if number.size == 8 else f"INT64_C({int(number.low)})"
    return f"(uint64_t){prefix}_nearest({scaled}, {low}, INT64_C({int(number.high)}))"


def _real(number: float) -> str:
    """Every digit that it needs, exactly."""
    return f"({float(number)!r})"


def comment(text: str) -> str:
    """A comment: what would end it is set apart, and what would begin another, of which compilers warn."""
    return f"/* {text.replace('*/', '* /').replace('/*', '/ *')} */"
