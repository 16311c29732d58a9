"""What `gatewayd rtde set` is to write, as people type it: `FIELD=VALUE`. Pure.

Outputs of the robot are switched by number (`standard_digital_output_3=on`), so that nobody has to make masks; analog
outputs have a unit, which selects their domain.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from gatewayd.rtde.catalogue import bit_word, suggest
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.fields import BITS_PER_WORD, INPUTS
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.types import INTEGER_RANGES, DataType

Value = Scalar | tuple[Scalar, ...]

_TRUTHS = {"on": True, "true": True, "1": True, "off": False, "false": False, "0": False}
_PINS = {"standard": 8, "configurable": 8, "tool": 2}
_PIN = re.compile(r"(standard|configurable|tool)_digital_output_([0-9]{1,3})")
_BIT = re.compile(r"input_bit_register_([0-9]{1,3})")
_ANALOG = re.compile(r"standard_analog_output_([01])")
_AMOUNT = re.compile(r"([0-9]+(?:\.[0-9]+)?)\s*(V|mA)")
_SLIDER = ("speed_slider", "speed_slider_fraction")
_SPANS = {"V": (0.0, 10.0), "mA": (4.0, 20.0)}
_BITS = 128
_ANALOG_TEXT = "standard_analog_output_0=5V or standard_analog_output_0=12mA"
_INSTEAD: Mapping[str, str] = {
    **{
        f"{kind}_digital_output{part}": f"{kind}_digital_output_1=on"
        for kind in _PINS
        for part in ("", "_mask")
    },
    "standard_analog_output_mask": _ANALOG_TEXT,
    "standard_analog_output_type": _ANALOG_TEXT,
    "speed_slider_mask": "speed_slider=50%",
}
"""Field that takes no value by itself -> what to write instead."""


class AssignmentError(ValueError):
    """What cannot be written; the text says why, and what to write instead."""


@dataclass(slots=True)
class Assignments:
    """What is to be written, by how it is written."""

    registers: dict[str, Value] = field(default_factory=dict)
    """Fields that act by themselves."""
    bits: dict[int, bool] = field(default_factory=dict)
    """General purpose input bits 0 to 127."""
    pins: dict[str, dict[int, bool]] = field(default_factory=dict)
    """By kind (`standard`, `configurable`, `tool`): digital outputs by number."""
    slider: float | None = None
    """0 to 1."""
    analog: dict[int, tuple[float, str]] = field(default_factory=dict)
    """By number: an amount and its unit, `V` or `mA`."""

    def fields(self) -> tuple[str, ...]:
        """The inputs that have to be claimed."""
        found = [*self.registers]
        for number in self.bits:
            plain = number >= 2 * BITS_PER_WORD
            found.append(f"input_bit_register_{number}" if plain else bit_word("input", number)[0])
        values = [f"{kind}_digital_output" for kind in self.pins]
        values += ["speed_slider_fraction"] if self.slider is not None else []
        values += [f"standard_analog_output_{number}" for number in self.analog]
        for value in values:
            needs = COMPANIONS[value]
            found += [name for name in (needs.mask, needs.type, value) if name is not None]
        return tuple(dict.fromkeys(found))


def parse_assignments(texts: Iterable[str]) -> Assignments:
    """Read `FIELD=VALUE` texts; AssignmentError for the first that cannot be written."""
    found = Assignments()
    seen: set[str] = set()
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name or not value:
            raise AssignmentError(f"{text!r} is not FIELD=VALUE, say input_int_register_24=7")
        if name in seen:
            raise AssignmentError(f"{name} is there twice")
        seen.add(name)
        _assign(found, name, value)
    both = [name for name in found.registers if name in _words(found.bits)]
    if both:
        raise AssignmentError(f"{both[0]} is written as a word and by its bits: choose one")
    return found


def _words(bits: Iterable[int]) -> set[str]:
    return {bit_word("input", number)[0] for number in bits if number < 2 * BITS_PER_WORD}


def _assign(found: Assignments, name: str, value: str) -> None:
    for pattern, assign in _KINDS:
        match = pattern.fullmatch(name)
        if match is not None:
            assign(found, match, value)
            return
    if name in _INSTEAD:
        raise AssignmentError(f"{name} acts only together with others: write {_INSTEAD[name]}")
    known = INPUTS.get(name)
    if known is None:
        near = suggest(name, INPUTS)
        close = f"; did you mean {' or '.join(near)}?" if near else "; gatewayd rtde fields lists all"
        raise AssignmentError(f"{name} is no input of the robot{close}")
    found.registers[name] = _value(name, known.type, value)


def _pin(found: Assignments, match: re.Match[str], value: str) -> None:
    kind, number = match[1], int(match[2])
    if number >= _PINS[kind]:
        raise AssignmentError(f"{match[0]}: of this kind there are 0 to {_PINS[kind] - 1}")
    found.pins.setdefault(kind, {})[number] = _truth(match[0], value)


def _bit(found: Assignments, match: re.Match[str], value: str) -> None:
    number = int(match[1])
    if number >= _BITS:
        raise AssignmentError(f"{match[0]}: input bits are 0 to {_BITS - 1}")
    found.bits[number] = _truth(match[0], value)


def _slide(found: Assignments, match: re.Match[str], value: str) -> None:
    if found.slider is not None:
        raise AssignmentError("the speed slider is there twice")
    percent = value.endswith("%")
    fraction = _real(match[0], value.removesuffix("%").strip()) / (100 if percent else 1)
    if not 0 <= fraction <= 1:
        raise AssignmentError(f"{match[0]} takes 0 to 1, or 0% to 100%, not {value}")
    found.slider = fraction


def _drive(found: Assignments, match: re.Match[str], value: str) -> None:
    amount = _AMOUNT.fullmatch(value)
    if amount is None:
        raise AssignmentError(f"{match[0]} takes an amount with its unit, say 5V or 12mA, not {value}")
    low, high = _SPANS[amount[2]]
    if not low <= float(amount[1]) <= high:
        raise AssignmentError(f"{match[0]} takes {low:g} to {high:g} {amount[2]}, not {value}")
    found.analog[int(match[1])] = float(amount[1]), amount[2]


_KINDS: tuple[tuple[re.Pattern[str], Callable[[Assignments, re.Match[str], str], None]], ...] = (
    (_PIN, _pin),
    (_BIT, _bit),
    (re.compile("|".join(_SLIDER)), _slide),
    (_ANALOG, _drive),
)


def _value(name: str, kind: DataType, text: str) -> Value:
    parts = text.replace(",", " ").split()
    if len(parts) != kind.count:
        raise AssignmentError(f"{name} is {kind.word}: {kind.count} with commas between them, not {text}")
    values = tuple(_element(name, kind, part) for part in parts)
    return values if kind.is_vector else values[0]


def _element(name: str, kind: DataType, text: str) -> Scalar:
    if kind.code == "?":
        return _truth(name, text)
    if kind.code not in INTEGER_RANGES:
        return _real(name, text)
    low, high = INTEGER_RANGES[kind.code]
    try:
        number = int(text, 0)
    except ValueError:
        raise AssignmentError(f"{name} takes a whole number, say 7 or 0x1f, not {text}") from None
    if not low <= number <= high:
        raise AssignmentError(f"{name} is {kind.word} and takes {low} to {high}, not {text}")
    return number


def _real(name: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise AssignmentError(f"{name} takes a number, say 0.5, not {text}") from None
    if not math.isfinite(number):
        raise AssignmentError(f"{name} takes a finite number, not {text}")
    return number


def _truth(name: str, text: str) -> bool:
    found = _TRUTHS.get(text.lower())
    if found is None:
        raise AssignmentError(f"{name} takes on or off, not {text}")
    return found
