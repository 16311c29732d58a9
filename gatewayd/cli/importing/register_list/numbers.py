"""Numbers, addresses, types and byte orders as register lists write them."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Final

_PLAIN = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?", re.ASCII)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}\.\d{3}", re.ASCII)
"""Where decimals may have a comma, 1.500 may be one and a half or fifteen hundred."""
_HEX = re.compile(
    r"(?:0[xX]|16#|\$)(?P<after>[0-9A-Fa-f]{1,4})|(?P<before>[0-9][0-9A-Fa-f]{0,3})[hH]", re.ASCII
)
_DECIMAL = re.compile(r"\d{1,6}", re.ASCII)
_PART = re.compile(r"(?P<address>[^.]+)(?:[.](?P<bit>\d{1,2}|high|low))?", re.ASCII)
_IEC = re.compile(r"%?(?P<kind>MW|MX|MD|QW|IW)(?P<number>\d{1,5})", re.ASCII | re.IGNORECASE)
_NUMBER = r"[-+]?(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][-+]?\d+)?"
_LIMITS = re.compile(
    rf"(?P<open>[\[(]?)\s*(?P<low>{_NUMBER})\s*(?P<sign>\.\.\.?|\u2026|\u2013|-|/|;|,|\bto\b|\bbis\b)\s*(?P<high>{_NUMBER})\s*"
    r"(?P<close>[\])]?)",
    re.ASCII,
)
MAX_ADDRESS: Final = 65535
AREAS: Final = {"0": "coil", "1": "discrete", "3": "input", "4": "holding"}
"""First digit of the traditional form -> area of a mapping."""
BIT_AREAS: Final = frozenset({"coil", "discrete"})

_AREA_NAMES: Final = {
    "holding": "holding holdingregister holdingregisters 4x 4xxxx 4xxxxx hr halteregister mw outputregister",
    "input": "input inputregister inputregisters 3x 3xxxx 3xxxxx ir eingangsregister eingaberegister",
    "coil": "coil coils 0x 0xxxx 0xxxxx co spule spulen merker",
    "discrete": "discrete discreteinput discreteinputs 1x 1xxxx 1xxxxx di diskretereingang eingangsbit",
}
_FUNCTIONS: Final = {1: "coil", 2: "discrete", 3: "holding", 4: "input", 5: "coil", 6: "holding", 15: "coil",
                     16: "holding", 22: "holding", 23: "holding"}  # fmt: skip
_TYPES: Final = {
    "bit": "bit", "bool": "bool", "boolean": "bool",
    "int16": "int16", "sint16": "int16", "short": "int16", "signed16": "int16", "s16": "int16", "i16": "int16",
    "uint16": "uint16", "word": "uint16", "ushort": "uint16", "unsigned16": "uint16", "u16": "uint16",
    "uint": "uint16", "int32": "int32", "dint": "int32", "sint32": "int32", "signed32": "int32", "s32": "int32",
    "i32": "int32", "uint32": "uint32", "udint": "uint32", "dword": "uint32", "unsigned32": "uint32",
    "u32": "uint32", "int64": "int64", "lint": "int64", "s64": "int64", "i64": "int64", "uint64": "uint64",
    "ulint": "uint64", "lword": "uint64", "u64": "uint64", "float32": "float32", "real": "float32",
    "f32": "float32", "single": "float32", "real32": "float32", "float64": "float64", "lreal": "float64",
    "double": "float64", "f64": "float64", "real64": "float64", "int8": "int8", "uint8": "uint8",
}  # fmt: skip
DOUBTFUL_TYPES: Final = {"int": "int16", "float": "float32", "integer": "int16"}
"""What means one thing in a PLC and another elsewhere."""
WORDS: Final = {"bit": 1, "bool": 1, "int8": 1, "uint8": 1, "int16": 1, "uint16": 1, "int32": 2, "uint32": 2,
                "float32": 2, "int64": 4, "uint64": 4, "float64": 4}  # fmt: skip
"""Registers of each type."""
_ORDERS: Final = {
    "abcd": "ABCD", "cdab": "CDAB", "badc": "BADC", "dcba": "DCBA", "bigendian": "ABCD", "be": "ABCD",
    "motorola": "ABCD", "wordswap": "CDAB", "wordswapped": "CDAB", "swapped": "CDAB", "lowwordfirst": "CDAB",
    "highwordfirst": "ABCD", "byteswap": "BADC", "byteswapped": "BADC", "wortgetauscht": "CDAB",
    "bytesgetauscht": "BADC",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Address:
    """An address of a list: counted from 0 or traditional, as it is written."""

    number: int
    area: str | None
    """Of the traditional form; None: the number alone."""
    part: str
    """Bit, `high` or `low`; empty."""
    doubtful: bool = False
    """It may be traditional or not: 40001 to 49999 and the like."""
    hexadecimal: bool = False
    doubt: str = ""
    """What was taken of several meanings of the notation, by an example: the same for all of its kind."""
    hint: str = ""
    written: bool | None = None
    """Whether the notation says that the PLC writes it; None: it says nothing."""


class NotReadable(Exception):
    """A text is no such thing; the text of the exception says what there might be."""


def real(text: str, *, comma: bool) -> float:
    """A number; with `comma` a comma may stand before the decimals. Raises NotReadable."""
    if comma and _THOUSANDS.fullmatch(text):
        raise NotReadable(f"write {text.replace('.', '')} or {text.replace('.', ',')}: it may be either")
    if _PLAIN.fullmatch(text):
        return float(text)
    if comma and _COMMA.fullmatch(text):
        return float(text.replace(",", "."))
    raise NotReadable(
        "write a number, for example 0.1" + (" or 0,1" if comma else "") + ", without thousands marks"
    )


def whole(text: str) -> int:
    """A whole number. Raises NotReadable."""
    value = real(text, comma=False)
    if not value.is_integer() or abs(value) > MAX_ADDRESS:
        raise NotReadable("write a whole number")
    return int(value)


def address(text: str) -> Address:
    """An address in one of the usual forms. Raises NotReadable."""
    match = _PART.fullmatch(text)
    if match is None:
        raise NotReadable(_FORMS)
    head, part = match["address"].strip(), match["bit"] or ""
    hexadecimal, iec = _HEX.fullmatch(head), _IEC.fullmatch(head)
    if hexadecimal is not None:
        return Address(int(hexadecimal["after"] or hexadecimal["before"], 16), None, part, hexadecimal=True)
    if iec is not None:
        return _of_iec(iec["kind"].upper(), int(iec["number"]), part)
    if not _DECIMAL.fullmatch(head):
        raise NotReadable(_FORMS)
    return _decimal(head, part)


_FORMS: Final = "write 100, 0x64, 100.3, 400101, %MW100, %MX100.3, %MD50, %QW100 or %IW100"


def _of_iec(kind: str, number: int, part: str) -> Address:
    """A located variable of IEC 61131-3 as a register; what its address counts, tools see differently."""
    if kind == "MX":
        if not part.isdecimal():
            raise NotReadable("write %MX100.3, with the bit")
        hint = "CODESYS counts bytes there: write 50.3 for its %MX100.3, and 50.11 for %MX101.3"
        return replace(_plain(number, part), doubt="%MXn.b is taken as bit b of %MWn", hint=hint)
    if kind == "MD":
        text = "%MDn is taken as the double word that begins at %MW(2n): %MD50 at %MW100"
        hint = "Schneider's controllers count words there: write %MW for their %MD"
        return replace(_plain(2 * number, part), doubt=text, hint=hint)
    if kind in ("QW", "IW"):
        side, verb = ("outputs", "writes") if kind == "QW" else ("inputs", "reads")
        text = f"%{kind} are {side} of the PLC: taken as registers of the same number, which it {verb}"
        hint = "write the register of the gateway to which they are mapped, and R or W as access"
        return replace(_plain(number, part), doubt=text, hint=hint, written=kind == "QW")
    return _plain(number, part)


def limits(text: str, *, comma: bool) -> tuple[float, float]:
    """Both limits of one cell: `0..100`, `0-100`, `[0;100]`, `0/100`. Raises NotReadable."""
    match = _LIMITS.fullmatch(text)
    whole_brackets = match is not None and bool(match["open"]) == bool(match["close"])
    if match is None or not whole_brackets or (match["sign"] == "," and (comma or not match["open"])):
        raise NotReadable("write both limits, for example 0..100")
    return real(match["low"], comma=comma), real(match["high"], comma=comma)


def _decimal(digits: str, part: str) -> Address:
    number, area = int(digits), AREAS.get(digits[0])
    traditional = len(digits) >= 5 and area is not None and int(digits[1:]) > 0
    if len(digits) == 6 or (len(digits) == 5 and digits[0] == "0"):
        if not traditional:
            raise NotReadable(_FORMS)
        return _plain(int(digits[1:]) - 1, part, area)
    if traditional and area is not None:
        return Address(int(digits[1:]) - 1, area, part, doubtful=True)
    return _plain(number, part)


def _plain(number: int, part: str, area: str | None = None) -> Address:
    if number > MAX_ADDRESS:
        raise NotReadable(f"{number} is greater than 65535")
    return Address(number, area, part)


def area(text: str) -> str:
    """The area of a mapping that a text names. Raises NotReadable."""
    folded = re.sub(r"[^a-z0-9]", "", text.lower())
    found = next((key for key, names in _AREA_NAMES.items() if folded in names.split()), None)
    if found is None:
        raise NotReadable("write holding, input, coil or discrete")
    return found


def function_area(text: str) -> str:
    """The area of a function code: `3`, `FC03`, `0x03`. Raises NotReadable."""
    digits = re.search(r"(?:0x)?0*(\d{1,2})\b", text, re.ASCII)
    if digits is None or int(digits[1]) not in _FUNCTIONS:
        raise NotReadable("write a function code: 1 to 6, 15, 16, 22 or 23")
    return _FUNCTIONS[int(digits[1])]


def number_type(text: str) -> tuple[str, bool]:
    """The type of a mapping, and whether the name means something else elsewhere. Raises NotReadable."""
    folded = re.sub(r"[^a-z0-9]", "", text.lower())
    if folded in DOUBTFUL_TYPES:
        return DOUBTFUL_TYPES[folded], True
    if folded not in _TYPES:
        raise NotReadable("write bit, bool, int16, uint16, int32, uint32, int64, uint64, float32 or float64")
    return _TYPES[folded], False


def word_order(text: str) -> str:
    """The order of a mapping. Raises NotReadable."""
    folded = re.sub(r"[^a-z]", "", text.lower())
    if folded not in _ORDERS:
        raise NotReadable(
            "write ABCD (big-endian), CDAB (words swapped), BADC (bytes swapped) or DCBA (both)"
        )
    return _ORDERS[folded]
