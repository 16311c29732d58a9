"""Functions that all blocks use: joining and turning words, and reals from bits where a tool has nothing of its own."""

from __future__ import annotations

from typing import Final

from gatewayd.plc.model import CellModel
from gatewayd.plc.st.dialect import Dialect, Primitives, elementary
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection, indented
from gatewayd.plc.st.types import has_wide


def functions(model: CellModel, dialect: Dialect, *, of_bytes: bool = False) -> tuple[ProgramUnit, ...]:
    """All of them; those for 64 bits only where something has so many.

    `of_bytes`: what comes are bytes with the least significant first, which make words; otherwise they are registers.
    """
    prefix = model.prefix
    first = _pair(prefix, dialect) if of_bytes else _swap(prefix, dialect)
    joined = [first, _join(prefix, "Double", "DWORD", ("high", "low"), dialect)]
    wide = has_wide(model)
    if wide:
        joined.append(_join(prefix, "Quad", "LWORD", ("a", "b", "c", "d"), dialect))
    return (*joined, *(unit for unit in dialect.primitives.units(prefix) if wide or "Lreal" not in unit.name))


def function(
    name: str,
    result: str,
    operands: tuple[tuple[str, str], ...],
    body: tuple[str, ...],
    *,
    local: tuple[PlcVariable, ...] = (),
    comment: str = "",
) -> ProgramUnit:
    """A function with its operands as (name, type)."""
    inputs = VariableSection(
        "VAR_INPUT", tuple(PlcVariable(operand, elementary(kind)) for operand, kind in operands)
    )
    sections = (inputs, VariableSection("VAR", local)) if local else (inputs,)
    return ProgramUnit("FUNCTION", name, sections, body, result, comment)


def _swap(prefix: str, dialect: Dialect) -> ProgramUnit:
    name = f"{prefix}_Swap"
    return function(
        name,
        "WORD",
        (("value", "WORD"),),
        (f"{dialect.result(name)} := {dialect.shift('ROL', 'value', '8')};",),
        comment="the two bytes of a register exchanged",
    )


def _pair(prefix: str, dialect: Dialect) -> ProgramUnit:
    name = f"{prefix}_Word"
    return function(
        name,
        "WORD",
        (("low", "BYTE"), ("high", "BYTE")),
        (
            f"{dialect.result(name)} := {dialect.shift('SHL', 'BYTE_TO_WORD(high)', '8')} OR BYTE_TO_WORD(low);",
        ),
        comment="two bytes of a PDO in one number, the least significant first",
    )


def _join(prefix: str, name: str, kind: str, words: tuple[str, ...], dialect: Dialect) -> ProgramUnit:
    parts = [
        dialect.shift("SHL", f"WORD_TO_{kind}({each})", str(by)) if by else f"WORD_TO_{kind}({each})"
        for each, by in zip(words, range(16 * (len(words) - 1), -1, -16), strict=True)
    ]
    return function(
        f"{prefix}_{name}",
        kind,
        tuple((each, "WORD") for each in words),
        (f"{dialect.result(f'{prefix}_{name}')} := {' OR '.join(parts)};",),
        comment="registers in one number, the most significant first",
    )


class _Format:
    """An IEEE 754 format as the portable functions take it apart."""

    def __init__(self, real: str, bits: str, integer: str, fraction: int, exponent: int) -> None:
        digits = (fraction + 1 + exponent) // 4
        self.real, self.bits, self.integer, self.fraction = real, bits, integer, fraction
        self.zero = f"{bits}#16#{0:0{digits}X}"
        self.sign = f"{bits}#16#{1 << (fraction + exponent):0{digits}X}"
        self.fraction_mask = f"{bits}#16#{(1 << fraction) - 1:0{digits}X}"
        self.exponent_mask = f"{bits}#16#{(1 << exponent) - 1:0{digits}X}"
        self.greatest = (1 << exponent) - 1
        self.bias = (1 << (exponent - 1)) - 1 + fraction
        self.implied = f"{real}#{float(1 << fraction)}"
        self.twice = f"{real}#{float(2 << fraction)}"
        self.nan = f"{bits}#16#{((1 << (exponent + 1)) - 1) << (fraction - 1):0{digits}X}"


_FORMATS: Final = (
    _Format("REAL", "DWORD", "UDINT", 23, 8),
    _Format("LREAL", "LWORD", "ULINT", 52, 11),
)
_STEPS: Final = (32, 1)
"""Powers of two by which a number is moved at once; all of them are exact."""


def _portable(prefix: str) -> tuple[ProgramUnit, ...]:
    return tuple(
        unit
        for form in _FORMATS
        for unit in (_to_real(f"{prefix}_To", form), _from_real(f"{prefix}_From", form))
    )


def _to_real(name: str, form: _Format) -> ProgramUnit:
    name = f"{name}{form.real.capitalize()}"
    integer, bits, real = form.integer, form.bits, form.real
    body = [
        f"exponent := {integer}_TO_INT({bits}_TO_{integer}(SHR(bits, {form.fraction}) AND {form.exponent_mask}));",
        f"number := {integer}_TO_{real}({bits}_TO_{integer}(bits AND {form.fraction_mask}));",
        "IF exponent = 0 THEN",
        "  exponent := 1;",
        "ELSE",
        f"  number := number + {form.implied};",
        "END_IF;",
        f"exponent := exponent - {form.bias};",
    ]
    for step in _STEPS:
        body += _while(
            f"exponent >= {step}", f"number := number * {real}#{float(1 << step)};", f"exponent - {step}"
        )
        body += _while(
            f"exponent <= -{step}", f"number := number / {real}#{float(1 << step)};", f"exponent + {step}"
        )
    body += [
        f"IF (bits AND {form.sign}) <> {form.zero} THEN",
        "  number := -number;",
        "END_IF;",
        f"{name} := number;",
    ]
    return function(
        name,
        real,
        (("bits", bits),),
        tuple(body),
        local=(PlcVariable("exponent", elementary("INT")), PlcVariable("number", elementary(real))),
        comment="the number that these bits are, if it is finite (IEEE 754)",
    )


def _from_real(name: str, form: _Format) -> ProgramUnit:
    name = f"{name}{form.real.capitalize()}"
    integer, bits, real = form.integer, form.bits, form.real
    body = (
        f"result := {form.zero};",
        "number := ABS(value);",
        "IF value <> value THEN",
        f"  result := {form.nan};",
        f"ELSIF number > {real}#0.0 THEN",
        *indented(_normalized(form)),
        f"  result := {integer}_TO_{bits}({real}_TO_{integer}(number)) AND {form.fraction_mask};",
        f"  result := result OR SHL({integer}_TO_{bits}(INT_TO_{integer}(exponent)), {form.fraction});",
        "END_IF;",
        f"IF value < {real}#0.0 THEN",
        f"  result := result OR {form.sign};",
        "END_IF;",
        f"{name} := result;",
    )
    return function(
        name,
        bits,
        (("value", real),),
        body,
        local=(
            PlcVariable("exponent", elementary("INT")),
            PlcVariable("number", elementary(real)),
            PlcVariable("result", elementary(bits)),
        ),
        comment="the bits of a number (IEEE 754)",
    )


def _normalized(form: _Format) -> list[str]:
    """The number moved into the range of its fraction, and by how much; infinity and the subnormal stop at the ends."""
    real = form.real
    return [
        f"exponent := {form.bias};",
        *_while(
            f"(number >= {form.twice}) AND (exponent < {form.greatest})",
            f"number := number / {real}#2.0;",
            "exponent + 1",
        ),
        *_while(
            f"(number < {form.implied}) AND (exponent > 1)",
            f"number := number * {real}#2.0;",
            "exponent - 1",
        ),
        f"IF exponent = {form.greatest} THEN",
        f"  number := {real}#0.0;",
        f"ELSIF number < {form.implied} THEN",
        "  exponent := 0;",
        "END_IF;",
    ]


def _while(condition: str, step: str, exponent: str) -> tuple[str, ...]:
    return (f"WHILE {condition} DO", f"  {step}", f"  exponent := {exponent};", "END_WHILE;")


PORTABLE: Final = Primitives(_portable, only_finite=True)
"""Arithmetic alone, for tools of edition 2 that have neither a union nor a conversion of bits."""
