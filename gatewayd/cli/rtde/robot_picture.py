"""How `gatewayd rtde watch` looks: a picture for terminals, lines for everything else. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from gatewayd.cli.rtde.value_rows import Value, lines, value_row
from gatewayd.report.printable import printable

_AROUND = 6
"""Lines of a picture that are no field."""


@dataclass(frozen=True, slots=True)
class RobotGlimpse:
    """What a robot reported at one moment."""

    address: str
    values: Mapping[str, Value]
    timestamp: float = 0.0
    """Of the controller, in seconds."""
    rate: float = 0.0
    """Packages per second; 0: not measured yet."""
    skipped: int = 0
    """Packages that the controller has not sent."""
    lost: str = ""
    """Why there is nothing newer; the rest is then old."""


def plain(glimpse: RobotGlimpse) -> list[str]:
    """A block of lines."""
    rows = [value_row(name, value) for name, value in glimpse.values.items()]
    return [printable(line) for line in (_head(glimpse), *(f"  {line}" for line in lines(rows)), "")]


def picture(glimpse: RobotGlimpse, before: RobotGlimpse | None, height: int) -> Group:
    """A picture for a screen of so many lines; values that differ from `before` are bright."""
    style = "dim" if glimpse.lost else ""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, style=style)
    for heading in ("field", "value", "unit", "meaning"):
        table.add_column(heading, overflow="fold")
    room = max(1, height - _AROUND)
    shown = list(glimpse.values.items())[:room]
    for name, value in shown:
        changed = before is not None and not glimpse.lost and before.values.get(name) != value
        row = value_row(name, value)
        table.add_row(
            Text(row.name),
            Text(row.value, "bold" if changed else style),
            Text(row.unit),
            Text(printable(row.meaning)),
        )
    left = len(glimpse.values) - len(shown)
    more = [Text(f" {left} more: name fewer, or make the window higher", "dim")] if left else []
    head = Text(f" {printable(_head(glimpse))} ", "bold white on red" if glimpse.lost else "bold")
    return Group(head, table, *more, Text(" q quit", "reverse"))


def _head(glimpse: RobotGlimpse) -> str:
    if glimpse.lost:
        return f"{glimpse.address}: everything below is old: {glimpse.lost}"
    rate = f"{glimpse.rate:.0f} Hz" if glimpse.rate else "measuring the rate"
    return f"{glimpse.address}  {glimpse.timestamp:.3f} s  {rate}, {glimpse.skipped or 'none'} skipped"
