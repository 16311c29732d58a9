"""Which raw numbers mean a declared limit.

A limit is a decimal number in the robot's unit. On a wire it is the nearest number that the register or object has,
which may decode to a hair more: the float32 nearest to 0.05 is 0.05000000074, and 3 * 0.1 is 0.30000000000000004.
To write that number is to mean the limit, so it decodes to exactly the limit: a robot never gets more, and a set-point
that stands on its maximum is not refused. The core compares values and knows of no encoding; so the limits are prepared
here, once for each place.

The raw number nearest to a limit means the limit, with one exception: an integer that means exactly 0 is never read as
a limit that is not 0. Who writes 0 means it.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, TypeAlias

from gatewayd.core.definition import Value, ValueKind

Meaning: TypeAlias = Callable[[float], Value | None]
"""What a raw number is in the robot's unit; None: nothing."""
Ends: TypeAlias = tuple[float | None, float | None]
"""Least and greatest value that may be written; None: whatever the type holds."""

_NOISE: Final = 4
"""Units in the last place by which scale and offset may be off."""


@dataclass(frozen=True, slots=True)
class _Pin:
    """Raw numbers from `first` to `last` mean `value`; of an integer there is one."""

    first: float
    last: float
    value: float


@dataclass(frozen=True, slots=True)
class LimitReader:
    """What decodes raw numbers at and around the limits. Between `below` and `above`, both excluded, `meaning` does."""

    below: float
    above: float
    meaning: Meaning
    pins: tuple[_Pin, ...]

    def read(self, raw: float) -> Value | None:
        """What any raw number means."""
        for pin in self.pins:
            if pin.first <= raw <= pin.last:
                return pin.value
        return self.meaning(raw)


def ends_of(
    kind: ValueKind, limits: tuple[float, float] | None, low: float | None, high: float | None
) -> Ends:
    """The least and greatest value that a variable of `kind` takes: by its limits, and by the robot's type."""
    if kind is ValueKind.BOOL:
        return None, None
    if limits is not None:
        low = limits[0] if low is None else max(low, limits[0])
        high = limits[1] if high is None else min(high, limits[1])
    if kind is ValueKind.INT:
        return None if low is None else math.ceil(low), None if high is None else math.floor(high)
    return None if low is None else float(low), None if high is None else float(high)


def read_limits(
    ends: Ends, code: str, meaning: Meaning, scale: float = 1.0, offset: float = 0.0
) -> LimitReader | None:
    """Prepare a number with the `struct` character `code`; None where `meaning` gives the limits exactly already."""
    pins: list[_Pin] = []
    below, above = -math.inf, math.inf
    for value, is_top in zip(ends, (scale < 0, scale > 0), strict=True):
        pin = None if value is None else _pin(value, code, meaning, scale, offset)
        if pin is None:
            continue
        pins.append(pin)
        if is_top:
            above = pin.first
        else:
            below = pin.last
    if not pins:
        return None
    # Where both limits are nearest to one raw number it means the nearer one.
    pins.sort(key=lambda pin: abs((pin.first + pin.last) / 2 * scale + offset - pin.value))
    return LimitReader(below, above, meaning, tuple(pins))


def _pin(value: float, code: str, meaning: Meaning, scale: float, offset: float) -> _Pin | None:
    found = list(_nearest(value, code, scale, offset))
    if not found or all(meaning(raw) == value for raw in found):
        return None
    if code not in "fd" and value != 0 and abs(found[0] * scale + offset) < 1e-9 * abs(scale):
        return None
    return _Pin(min(found), max(found), value)


def _nearest(value: float, code: str, scale: float, offset: float) -> Iterator[float]:
    """The nearest raw number, or the ends of those that cannot be distinguished from it; none beyond the type."""
    is_plain = scale == 1 and offset == 0
    exact = value if is_plain else (value - offset) / scale  # integers of 64 bits keep every digit
    if not math.isfinite(exact):
        return
    noise: float = 0
    if code not in "fd":
        exact = round(exact)
    elif not is_plain:
        noise = _NOISE * math.ulp(max(abs(value), abs(offset), abs(value - offset))) / abs(scale)
    layout = struct.Struct(">" + code)
    for raw in (exact - noise, exact + noise):
        try:
            yield layout.unpack(layout.pack(raw))[0]
        except (struct.error, OverflowError):
            return
