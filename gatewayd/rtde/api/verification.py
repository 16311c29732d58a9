"""How a robot shows that a write has arrived: which output stands for which input, and what it has to be."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from gatewayd.rtde.api.completion import Elements
from gatewayd.rtde.api.sample import Sample
from gatewayd.rtde.fields import OUTPUTS

DIGITAL_BITS = "actual_digital_output_bits"
_SHIFTS = {"standard_digital_output": 0, "configurable_digital_output": 8, "tool_digital_output": 16}
_SLIDER_TOLERANCE = 0.005
_ANALOG_TOLERANCE = 0.01
_SPANS = {0: (4.0, 16.0), 1: (0.0, 10.0)}
"""Analog domain -> mA or V at ratio 0, and from there to ratio 1."""

SHOWN_BY: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(_SHIFTS, (DIGITAL_BITS,)),
    "speed_slider_fraction": ("target_speed_fraction",),
    "standard_analog_output_0": ("standard_analog_output0",),
    "standard_analog_output_1": ("standard_analog_output1",),
}
"""Input that cannot be read back under its own name -> the outputs that show what became of it."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """What an output shows once a write has arrived."""

    output: str
    wanted: object
    """For people."""
    holds: Callable[[object], bool]


def shown_by(name: str) -> tuple[str, ...]:
    """The outputs that show what an input holds; none for a mask, a type and an external wrench."""
    if name in SHOWN_BY:
        return SHOWN_BY[name]
    return (name,) if name.startswith("input_") and name in OUTPUTS else ()


def expectations(given: Mapping[str, Elements]) -> Iterator[Expectation]:
    """What the outputs show once these fields have been written, with the masks and types that belong to them."""
    for name, value in given.items():
        if name in _SHIFTS:
            yield _bits(name, int(given[f"{name}_mask"][0]), int(value[0]))
        elif name == "speed_slider_fraction":
            yield _near("target_speed_fraction", float(value[0]), _SLIDER_TOLERANCE)
        elif name in SHOWN_BY:
            number = int(name[-1])
            low, span = _SPANS[int(given["standard_analog_output_type"][0]) >> number & 1]
            yield _near(SHOWN_BY[name][0], low + span * float(value[0]), _ANALOG_TOLERANCE * span)
        elif shown_by(name):
            yield _same(name, value)


def failed(expected: tuple[Expectation, ...], sample: Sample | None) -> dict[str, tuple[object, object]]:
    """Wanted and seen value of each output that does not show what it should."""
    if sample is None:
        return {each.output: (each.wanted, None) for each in expected}
    return {
        each.output: (each.wanted, sample[each.output])
        for each in expected
        if not each.holds(sample[each.output])
    }


def _same(name: str, value: Elements) -> Expectation:
    wanted = value[0] if len(value) == 1 else value

    def holds(seen: object) -> bool:
        return seen == wanted or (_is_nan(seen) and _is_nan(wanted))

    return Expectation(name, wanted, holds)


def _bits(name: str, mask: int, value: int) -> Expectation:
    shift = _SHIFTS[name]
    chosen, wanted = mask << shift, (value & mask) << shift
    return Expectation(
        DIGITAL_BITS,
        f"{wanted:#x} in {chosen:#x}",
        lambda seen: isinstance(seen, int) and seen & chosen == wanted,
    )


def _near(output: str, wanted: float, tolerance: float) -> Expectation:
    return Expectation(
        output, wanted, lambda seen: isinstance(seen, float) and abs(seen - wanted) <= tolerance
    )


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)
