"""Values, times, counts and addresses for people: the same in commands, events, status page and demonstration.

What programs read has every digit, and comes from elsewhere.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

_DIGITS = 3
_JUST_NOW = 0.0005
"""Seconds up to which an age has no figure: half a millisecond is rounded to none."""
YOU = "you"
"""Who takes part in the demonstration."""
MAX_PORT = 0xFFFF
_ADDRESS = re.compile(
    r"(?:\[(?P<bracketed>[0-9A-Fa-f:.]+(?:%[\w.-]+)?)\]|(?P<name>[^\s:/\[\]]+))(?::(?P<port>[0-9]{1,5}))?"
)
_BARE = re.compile(r"[0-9A-Fa-f.]*:[0-9A-Fa-f.]*:[0-9A-Fa-f:.]*(?:%[\w.-]+)?")
"""IPv6 without brackets, which no port can follow."""
_PLURALS = {"be": "are"}
_SINGULARS = {"be": "is", "have": "has", "do": "does", "go": "goes"}


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


def exact(number: float) -> str:
    """Every digit that matters, and none that does not."""
    return repr(number).removesuffix(".0").lower()


def interval(low: float, high: float) -> str:
    """`-0.05..0.05`, with every digit that matters: what is just outside must not look as if it were within."""
    return f"{exact(low)}..{exact(high)}"


def seconds(duration: float | None) -> str:
    """`0.25 s`, with every digit that matters; empty for None."""
    return "" if duration is None else f"{exact(duration)} s"


def age(duration: float | None) -> str:
    """`12 ms`, `3.4 s`, `5 min`, `2 h`; `-` for never: None or infinity."""
    if duration is None or duration == math.inf:
        return "-"
    if duration < 1:
        return f"{max(0.0, duration) * 1000:.0f} ms"
    return f"{duration:.1f} s" if duration < 60 else span(duration)


def span(duration: float) -> str:
    """Two units at most: `42 s`, `2 h 13 min`, `3 d 4 h`."""
    parts: list[str] = []
    left = max(0, round(duration))
    for size, unit in ((86400, "d"), (3600, "h"), (60, "min"), (1, "s")):
        count, left = divmod(left, size)
        if count or (unit == "s" and not parts):
            parts.append(f"{count} {unit}")
    return " ".join(parts[:2])


def ago(duration: float | None) -> str:
    """`12 ms ago`, `5 min ago`; `just now` where no figure would be left, `never` for None or infinity."""
    if duration is None or duration == math.inf:
        return "never"
    return "just now" if duration <= _JUST_NOW else f"{age(duration)} ago"


def counted(count: int, noun: str) -> str:
    """`1 lock`, `2 locks`, `no locks`; `noun` is in the singular."""
    return f"{count or 'no'} {noun if count == 1 else plural(noun)}"


def plural(noun: str) -> str:
    """`locks`, `entries`, `switches`: of a regular noun, or of one that ends in such a word."""
    if noun.endswith(("s", "x", "z", "ch", "sh")):
        return f"{noun}es"
    if noun.endswith("y") and noun[-2:-1] not in "aeiou":
        return f"{noun[:-1]}ies"
    return f"{noun}s"


def verb(base: str, subject: str = "", count: int = 1) -> str:
    """The present tense that agrees: `holds` for `plc`, `hold` for `you` and for several; of `be` `is` and `are`.

    A writer may be called `you`, as the participant in the demonstration is.
    """
    if count != 1 or subject.casefold() == YOU:
        return _PLURALS.get(base, base)
    return _SINGULARS.get(base) or plural(base)


def address(host: str, port: int) -> str:
    """`127.0.0.1:502`, `[::1]:502`."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def split_address(text: str) -> tuple[str, int | None] | None:
    """Host, without brackets, and port of `127.0.0.1:502`, `[::1]:502`, `::1`; None: it is of no such form.

    Neither is judged: the host may be unknown, the port have up to five digits.
    """
    if _BARE.fullmatch(text):
        return text, None
    found = _ADDRESS.fullmatch(text)
    if found is None:
        return None
    return found["bracketed"] or found["name"], int(found["port"]) if found["port"] else None


def parse_address(text: str, default: int | None = None) -> tuple[str, int]:
    """Host and port as people type them; ValueError says what is expected.

    Without `default` it is where to listen, at a free port if that is 0; with it where to connect to, and it may be
    left away.
    """
    host, port = split_address(text) or ("", None)
    port = default if port is None else port
    least, form = 0, "HOST:PORT, say 127.0.0.1:9502 or [::1]:9502"
    if default is not None:
        least, form = 1, f"HOST or HOST:PORT, say 192.0.2.10 or robot.local:{default}"
    if not host or port is None or not least <= port <= MAX_PORT:
        raise ValueError(f"{text!r} is not {form}")
    return host, port


def listed(names: Sequence[str], most: int) -> str:
    """`a, b, c and 3 more`: the first `most` by name."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")
