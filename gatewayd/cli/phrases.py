"""What a gateway answers, in words for a terminal: values, ages, owners, events. Pure: JSON objects in, texts out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

__all__ = ["BAD_EVENTS", "age", "clock", "event", "number", "owner", "places", "record", "span", "value"]

BAD_EVENTS = frozenset(
    {
        "robot lost",
        "robot values stale",
        "register unavailable",
        "read-back differs",
        "writer lost",
        "write refused",
        "value forced",
    }
)
"""Events that somebody should look at."""
_DIGITS = 3


def value(found: object, unit: str = "") -> str:
    """A value for people: 0 or 1 for a bit, at most three decimals, and its unit."""
    if isinstance(found, bool):
        return "1" if found else "0"
    if isinstance(found, float):
        small = found and abs(found) < 10**-_DIGITS
        text = (
            f"{found:.3g}"
            if small or abs(found) >= 10**12
            else f"{found:.{_DIGITS}f}".rstrip("0").rstrip(".")
        )
    else:
        text = str(found)
    return f"{text} {unit}".rstrip()


def age(seconds: float | None) -> str:
    """`12 ms`, `3.4 s`, `5 min`, `2 h`; `-` for never."""
    if seconds is None:
        return "-"
    if seconds < 1:
        return f"{seconds * 1000:.0f} ms"
    return f"{seconds:.1f} s" if seconds < 60 else span(seconds)


def span(seconds: float) -> str:
    """Two units at most: `42 s`, `2 h 13 min`, `3 d 4 h`."""
    parts: list[str] = []
    left = int(seconds)
    for size, unit in ((86400, "d"), (3600, "h"), (60, "min"), (1, "s")):
        count, left = divmod(left, size)
        if count or (unit == "s" and not parts):
            parts.append(f"{count} {unit}")
    return " ".join(parts[:2])


def number(count: int, noun: str) -> str:
    """`1 lock`, `2 locks`, `no locks`."""
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"


def owner(variable: Mapping[str, Any]) -> str:
    """`plc, 4.2 s left`; `robot` for outputs."""
    if variable["forced"] is not None:
        return f"forced, {age(variable['forced']['remaining'])} left"
    if variable["direction"] == "output":
        return "robot"
    name = variable["owner"] or "free"
    return name if variable["lease"] is None else f"{name}, {age(variable['lease'])} left"


def places(variable: Mapping[str, Any]) -> str:
    """`400011`, or several."""
    return " ".join(place["notation"] for place in variable["modbus"])


def clock(time: str) -> str:
    """The local time of a UTC time stamp."""
    return datetime.fromisoformat(time).astimezone().strftime("%H:%M:%S")


def event(found: Mapping[str, Any]) -> str:
    """One event in a sentence, without its time."""
    return " ".join(filter(None, _words(found)))


def record(found: Mapping[str, Any]) -> str:
    """One record of the audit in a sentence, without its time."""
    if found["what"] != "write accepted":
        return event({**found, "event": found["what"], "other": found.get("holder", "")})
    times = f" ({found['times']} changes)" if "times" in found else ""
    return (
        f"{found['writer']} wrote {found['variable']}: {value(found['old'])} -> {value(found['new'])}{times}"
    )


def _words(found: Mapping[str, Any]) -> Iterator[str]:
    kind, writer, other = found["event"], found.get("writer", "somebody"), found.get("other", "")
    variable, lock, detail = found.get("variable", ""), found.get("lock", ""), found.get("detail", "")
    match kind:
        case "write refused":
            yield f"{writer} wrote {variable or 'an address'}" + (
                f" = {value(found['new'])}:" if "new" in found else ":"
            )
            yield "refused,"
            yield f"held by {other}" if other else found.get("reason", "")
            yield f"({found['repeats'] + 1} times)" if "repeats" in found else ""
        case "lock acquired":
            yield f"{writer} took {lock}"
            yield f"({detail})" if detail else ""
        case "lock taken over":
            yield f"{writer} took {lock} over from {other}"
            yield f"({detail})" if detail else ""
        case "lock released":
            yield f"{writer} lost {lock}: {detail}"
        case "fallback applied":
            yield f"{variable} fell back from {value(found.get('old'))} to {value(found.get('new'))}"
        case "value forced":
            yield f"{writer} forced {variable} to {value(found.get('new'))}"
            yield f"({detail})" if detail else ""
        case "force ended":
            yield f"{variable} is no longer forced: {detail}"
        case "writer connected" | "writer lost":
            yield f"{kind.replace('writer', writer, 1)}" + (f": {detail}" if detail else "")
        case _:
            yield kind + (f" {variable}" if variable else "") + (f": {detail}" if detail else "")
