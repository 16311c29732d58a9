"""The table of `gatewayd watch`: the columns that a screen has room for, and the lines of a variable in them. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rich import box
from rich.table import Table
from rich.text import Text

from gatewayd.cli import phrases
from gatewayd.report.fitting import GAP, fitted, folded
from gatewayd.report.format import age
from gatewayd.report.words import QUALITY_COLOURS, quality

Answer = Mapping[str, Any]

_TINY, _NARROW, _WIDE, _SPACIOUS = 60, 80, 96, 124
"""Columns of a screen from which on quality, age and owner have their own, there are blanks to spare, and there is room
for the places, and for the robot's name.
"""
_TOWARDS, _FROM = " → ", " ← "
_NEEDED: Final = {"places": _WIDE, "robot register": _SPACIOUS}
_EXPENDABLE: Final = ("robot register", "places", "age")
_USUAL: Final = {"variable": 18, "value": 10, "quality": 12, "age": 7, "owner": 18}
"""What columns take where there is room, so that the picture stays calm."""


@dataclass(frozen=True, slots=True)
class TableLayout:
    """How the variables of one picture are shown."""

    widths: Mapping[str, int]
    """By name of the column."""
    left_out: tuple[str, ...]
    """Columns without room."""
    gap: int
    """Blanks between two columns."""
    several: bool
    """Whether names have their cell in front."""

    def height(self, variable: Answer) -> int:
        """Lines that the variable takes."""
        texts = _texts(variable, several=self.several)
        return max(len(_lines(texts[name], width)) for name, width in self.widths.items())

    def shown(self, variables: Sequence[Answer], room: int) -> int:
        """How many of these, from the first on, have room in so many lines; at least one."""
        for count, variable in enumerate(variables):
            room -= self.height(variable)
            if room < 0:
                return max(1, count)
        return len(variables)

    def table(self, variables: Sequence[Answer], old: Mapping[Any, Any], style: str) -> Table:
        """The table; values that differ from `old` are bright."""
        table = Table(
            box=box.SIMPLE_HEAD,
            padding=(0, self.gap - GAP, 0, 0),
            pad_edge=False,
            expand=False,
            show_edge=False,
        )
        for name, width in self.widths.items():
            if name == "variable":
                table.add_column(" " * len(_TOWARDS) + name, no_wrap=True, width=len(_TOWARDS) + width)
            else:
                right = name in ("value", "age")
                table.add_column(name, justify="right" if right else "left", no_wrap=True, width=width)
        for variable in variables:
            table.add_row(*self._cells(variable, old), style=style)
        return table

    def _cells(self, variable: Answer, old: Mapping[Any, Any]) -> Iterator[Text]:
        towards = variable["direction"] == "input"
        arrow = Text(_TOWARDS, "bold cyan") if towards else Text(_FROM, "bold green")
        texts, styles = _texts(variable, several=self.several), _styles(variable, old)
        for name, width in self.widths.items():
            lines, style = _lines(texts[name], width), styles.get(name, "dim")
            if name == "variable":
                yield arrow.append(f"\n{' ' * len(_TOWARDS)}".join(lines), style)
            else:
                yield Text("\n".join(lines), style)


def layout(variables: Sequence[Answer], width: int, *, several: bool) -> TableLayout:
    """For all variables that may be scrolled to, so that the columns stay where they are."""
    names = [name for name in (*_USUAL, *_NEEDED) if width >= _NEEDED.get(name, 0)]
    if width < _TINY:
        names = ["variable", "value", "state"]
    texts = [_texts(variable, several=several) for variable in variables]
    gap = GAP + (width >= _NARROW)
    room = width - len(_TOWARDS) - (gap - GAP) * len(names)
    longest = max(10, width // 5)
    found = fitted(
        {
            # The head is one word, the others are as broken as they may have to be.
            name: [name.replace(" ", "-"), *(_broken(name, text[name], longest) for text in texts)]
            for name in names
        },
        room,
        _EXPENDABLE,
    )
    widths = dict(found.widths)

    def total() -> int:
        return sum(widths.values()) + GAP * (len(widths) - 1)

    while total() > room and any(width > 1 for name, width in widths.items() if name != "value"):
        # One word is too long for all screens like this: it is broken, and a number is not.
        widths[max((name for name in widths if name != "value"), key=lambda name: widths[name])] -= 1
    for name, usual in _USUAL.items():
        if width >= _NARROW and name in widths:
            widths[name] += max(0, min(usual - widths[name], room - total()))
    left_out = (
        *(name for name in found.dropped if name == "age"),
        *(name for name in _NEEDED if name not in widths),
    )
    return TableLayout(widths, left_out, gap, several)


def _texts(variable: Answer, *, several: bool) -> dict[str, str]:
    state, old = phrases.quality(variable["quality"]), age(variable["age"])
    owner = phrases.owner(variable)
    return {
        "variable": f"{variable['cell']}:{variable['name']}" if several else variable["name"],
        "value": phrases.value(variable),
        "quality": state,
        "age": old,
        "owner": owner,
        "places": phrases.places(variable),
        "robot register": variable["robot"],
        "state": f"{state}, {old}; {owner}",
    }


def _styles(variable: Answer, old: Mapping[Any, Any]) -> dict[str, str]:
    changed = old.get((variable["cell"], variable["name"]), variable["value"]) != variable["value"]
    of_quality = QUALITY_COLOURS[quality(variable["quality"])]
    by_operator = variable["forced"] or variable["owner"] == "operator"
    owner = "magenta" if by_operator else "yellow" if variable["lease"] else ""
    return {
        "variable": "bold default",
        "value": "bold yellow" if changed else "bold",
        "quality": of_quality,
        "state": of_quality,
        "owner": owner if variable["direction"] == "input" or variable["forced"] else "dim",
    }


def _broken(column: str, text: str, longest: int) -> str:
    """With blanks where a word of a name would make others yield; a number may."""
    return text if column == "value" or len(text) <= longest else " ".join(_lines(text, longest))


def _lines(text: str, width: int) -> list[str]:
    """The text in lines of at most `width`; a word that is longer is broken."""
    return [
        line[at : at + width]
        for line in folded(text, width).split("\n")
        for at in range(0, max(1, len(line)), width)
    ]
