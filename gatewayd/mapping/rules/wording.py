"""How findings name addresses, numbers and lists of things, so that every rule says it alike."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence

from gatewayd.mapping.expand import ConcretePlacement
from gatewayd.modbus.areas import Area

__all__ = [
    "AREA_WORDS",
    "cob",
    "did_you_mean",
    "first_of_each_line",
    "names_and_more",
    "number",
    "one_and_more",
    "seconds",
    "where",
]

AREA_WORDS = {
    Area.HOLDING: "holding register",
    Area.INPUT: "input register",
    Area.COIL: "coil",
    Area.DISCRETE: "discrete input",
}
"""What one address of an area is called."""


def where(placement: ConcretePlacement) -> str:
    """Where it lies, both ways of counting: `holding registers 100 to 103 (400101 to 400104)`."""
    word = AREA_WORDS[placement.area]
    if placement.bit is not None:
        return f"bit {placement.bit} of {word} {placement.address} ({placement.notation})"
    if placement.words == 1:
        return f"{word} {placement.address} ({placement.notation})"
    last = placement.address + placement.words - 1
    return f"{word}s {placement.address} to {last} ({placement.notation} to {placement.area.notation(last)})"


def number(value: float) -> str:
    """A number as people write it: without `.0`, without digits that mean nothing."""
    if isinstance(value, int):
        return str(value)
    return f"{value:.10g}"


def cob(cob_id: int) -> str:
    """A COB-ID as every finding and table shows it: `0x1A0`."""
    return f"0x{cob_id:03X}"


def seconds(duration: float) -> str:
    """A duration as the mapping writes it: `500ms` or `2s`."""
    return f"{number(duration * 1000)}ms" if duration < 1 else f"{number(duration)}s"


def one_and_more(names: Sequence[str]) -> str:
    """The first name in backticks and how many follow."""
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"`{names[0]}`{more}"


def names_and_more(names: Sequence[str]) -> str:
    """The first two names in backticks and how many follow: "`a`, `b` and 3 more"."""
    shown = " and ".join(f"`{name}`" for name in names[:2])
    return shown if len(names) <= 2 else f"{shown.replace(' and ', ', ')} and {len(names) - 2} more"


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """A hint that names the nearest known name, in whatever case it was written, or else says `otherwise`."""
    names = list(known)
    same = [one for one in names if one.casefold() == name.casefold()]
    close = same or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    return f"did you mean `{close[0]}`?" if close else otherwise


def first_of_each_line(placements: Iterable[ConcretePlacement]) -> Iterator[ConcretePlacement]:
    """Of a family on one line only the first: one mistake is one finding."""
    seen: set[tuple[str, int]] = set()
    for placement in placements:
        key = placement.variable.part.name, id(placement.spec)
        if key not in seen:
            seen.add(key)
            yield placement
