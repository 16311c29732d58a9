"""Between raw numbers and values in structured text: scale, offset, rounding, and what a value is when it is lost."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Final

from gatewayd.plc.model import CellModel, Encoding, Tag, initial
from gatewayd.plc.numbers import NUMBERS, REALS
from gatewayd.plc.st.dialect import Dialect, elementary, literal, real
from gatewayd.plc.st.program import PlcVariable

_INFINITE: Final = {"REAL": "DWORD#16#7F800000", "LREAL": "LWORD#16#7FF0000000000000"}
"""The exponent of what is no finite number."""
SCRATCH: Final = tuple(
    PlcVariable(name, elementary(kind))
    for name, kind in (
        ("octet", "BYTE"),
        ("value", "WORD"),
        ("double", "DWORD"),
        ("quad", "LWORD"),
        ("real_raw", "REAL"),
        ("real_nearest", "REAL"),
        ("lreal_raw", "LREAL"),
        ("lreal_nearest", "LREAL"),
    )
)
"""Local variables of blocks that convert; only those are declared that are used."""
JOINED: Final = tuple(variable for variable in SCRATCH if variable.name in ("double", "quad"))
"""Those of blocks that only read."""
UNREADABLE: Final = PlcVariable(
    "unreadable", elementary("BOOL"), "a real is NaN or infinite: its value stayed as it was"
)


def from_bits(target: str, bits: str, tag: Tag, model: CellModel, dialect: Dialect) -> Iterator[str]:
    """What makes a value of the 32 or 64 bits that a DWORD or LWORD holds."""
    assert tag.encoding is not None
    wire = NUMBERS[tag.encoding.type].type
    kind = "DWORD" if NUMBERS[tag.encoding.type].size == 4 else "LWORD"
    if wire not in REALS:
        yield f"{target} := {value_of(f'{kind}_TO_{wire}({bits})', tag)};"
        return
    assigned = f"{target} := {value_of(dialect.call(model, f'To{wire.capitalize()}', bits=bits), tag)};"
    if not dialect.primitives.only_finite:
        yield assigned
        return
    yield f"IF ({bits} AND {_INFINITE[wire]}) <> {_INFINITE[wire]} THEN"
    yield f"  {assigned}"
    yield "ELSE"
    yield "  unreadable := TRUE;"
    yield "END_IF;"


def value_of(raw: str, tag: Tag) -> str:
    """The raw number with scale and offset, as the type of the value."""
    encoding = tag.encoding
    assert encoding is not None
    wire = NUMBERS[encoding.type].type
    if tag.type == "BOOL":
        return f"{raw} <> {real(0, wire) if wire in REALS else 0}"
    if not tag.arithmetic:
        return raw
    number = raw if wire == tag.arithmetic else f"{wire}_TO_{tag.arithmetic}({raw})"
    scaled = number if encoding.scale == 1 else f"{number} * {real(encoding.scale, tag.arithmetic)}"
    if encoding.offset:
        scaled = f"{scaled} + {real(encoding.offset, tag.arithmetic)}"
    return scaled


def fallback(tag: Tag) -> Iterator[str]:
    """What the value is when gateway or connection are lost: the same that the gateway shows when the robot is."""
    value = initial(tag)
    if value is not None:
        yield f"outputs.{tag.path} := {literal(value, tag.type)};"


def raw_of(tag: Tag, encoding: Encoding) -> Generator[str, None, str]:
    """The raw number as the register's type: rounded to the nearest, and never beyond the type."""
    source = f"inputs.{tag.path}"
    if not tag.arithmetic:
        return source
    wire, kind = NUMBERS[encoding.type].type, tag.arithmetic
    value = source
    if encoding.offset:
        value = f"({value} - {real(encoding.offset, kind)})"
    if encoding.scale != 1:
        value = f"{value} / {real(encoding.scale, kind)}"
    name = kind.lower()
    yield f"{name}_raw := {value};"
    if wire in REALS:
        return f"{name}_raw" if wire == kind else f"{kind}_TO_{wire}({name}_raw)"
    number = NUMBERS[encoding.type]
    high = number.largest
    yield f"{name}_nearest := {name}_raw;"
    yield f"IF {name}_raw >= {real(high, kind)} THEN"
    yield f"  {name}_nearest := {real(high, kind)};"
    yield f"ELSIF {name}_raw <= {real(number.low, kind)} THEN"
    yield f"  {name}_nearest := {real(number.low, kind)};"
    yield f"ELSIF {name}_raw <> {name}_raw THEN"
    yield f"  {name}_nearest := {real(0, kind)};"
    yield "END_IF;"
    yield f"clipped := clipped OR NOT (ABS({name}_raw - {name}_nearest) <= {real(0.5, kind)});"
    return f"{kind}_TO_{wire}({name}_nearest)"
