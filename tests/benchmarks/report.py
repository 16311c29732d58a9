"""What a benchmark hands over: tables of text, each with the definition of what was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

BAR = 40
"""Width of a histogram's longest bar."""


@dataclass
class Table:
    """A title, what the figures mean, and the figures."""

    title: str
    definition: str
    header: tuple[str, ...]
    rows: list[tuple[str, ...]] = field(default_factory=list)
    note: str = ""
    """Stands below the rows."""

    def add(self, *cells: str) -> None:
        """Append a row; missing cells stay empty."""
        self.rows.append(cells + ("",) * (len(self.header) - len(cells)))

    def __str__(self) -> str:
        lines = [self.header, *self.rows]
        widths = [max(len(line[column]) for line in lines) for column in range(len(self.header))]
        text = [
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
            for line in lines
        ]
        title = [self.title, "=" * len(self.title), self.definition, ""]
        note = [self.note] if self.note else []
        return "\n".join([*title, text[0], "-" * len(text[0]), *text[1:], *note])


def at_most(value: float, aim: float, unit: str = "") -> str:
    """`value` with the aim that it should not exceed, and whether it does."""
    return _judged(value, aim, "<=", unit, met=value <= aim)


def at_least(value: float, aim: float, unit: str = "") -> str:
    """`value` with the aim that it should reach, and whether it does."""
    return _judged(value, aim, ">=", unit, met=value >= aim)


def against(
    own: float | None, other: float | None, judge: Callable[[float, float], str], aim: float | None = None
) -> str:
    """`own` as a multiple of `other`, judged where there is an aim; a dash where one of them was not measured."""
    if not own or not other:
        return "-"
    return f"{own / other:.3g}" if aim is None else judge(own / other, aim)


def _judged(value: float, aim: float, sign: str, unit: str, *, met: bool) -> str:
    return f"{value:.3g}{unit} (aim {sign} {aim:g}{unit}: {'met' if met else 'MISSED'})"


def percentile(values: Sequence[float], share: float) -> float:
    """The least of `values` that at least `share` (0..1) of them do not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def histogram(seconds: Sequence[float], bounds: Sequence[float]) -> list[tuple[str, ...]]:
    """Rows "up to, share, bar" for times in seconds and bounds in milliseconds."""
    counts = [0] * (len(bounds) + 1)
    for value in seconds:
        counts[sum(value * 1000 > bound for bound in bounds)] += 1
    names = [f"<= {bound:g} ms" for bound in bounds] + [f"> {bounds[-1]:g} ms"]
    greatest = max(counts)
    return [
        (name, f"{100 * count / len(seconds):5.1f} %", "#" * round(BAR * count / greatest))
        for name, count in zip(names, counts, strict=True)
    ]
