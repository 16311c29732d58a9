"""Values, times and counts in figures for people: the same in commands, sentences, status page and demonstration.

What programs read is told elsewhere, with every digit.
"""

from __future__ import annotations

import math

__all__ = ["age", "counted", "span", "value"]

_DIGITS = 3


def value(found: object, unit: str = "") -> str:
    """A value, or a text that stands for one: 0 or 1 for a bit, at most three decimals, and its unit."""
    if isinstance(found, bool):
        return "1" if found else "0"
    text = _real(found) if isinstance(found, float) else str(found)
    return f"{text} {unit}".rstrip()


def _real(real: float) -> str:
    if real and (abs(real) < 10**-_DIGITS or abs(real) >= 10**12):
        return f"{real:.{_DIGITS}g}"
    return f"{real:.{_DIGITS}f}".rstrip("0").rstrip(".")


def age(seconds: float | None) -> str:
    """`12 ms`, `3.4 s`, `5 min`, `2 h`; `-` for never: None or infinity."""
    if seconds is None or seconds == math.inf:
        return "-"
    if seconds < 1:
        return f"{max(0.0, seconds) * 1000:.0f} ms"
    return f"{seconds:.1f} s" if seconds < 60 else span(seconds)


def span(seconds: float) -> str:
    """Two units at most: `42 s`, `2 h 13 min`, `3 d 4 h`."""
    parts: list[str] = []
    left = max(0, round(seconds))
    for size, unit in ((86400, "d"), (3600, "h"), (60, "min"), (1, "s")):
        count, left = divmod(left, size)
        if count or (unit == "s" and not parts):
            parts.append(f"{count} {unit}")
    return " ".join(parts[:2])


def counted(count: int, noun: str) -> str:
    """`1 lock`, `2 locks`, `no locks`."""
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"
