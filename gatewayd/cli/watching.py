"""How `gatewayd watch` looks, and what its keys do. Pure: answers and a view in, a picture out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from gatewayd.cli import phrases
from gatewayd.report.format import age
from gatewayd.report.words import LEVEL_COLOURS, QUALITY_COLOURS, SOURCE_LEVELS, quality, source

Answer = Mapping[str, Any]

KEYS = "q quit   / filter   Esc clear   d direction   b only bad   space pause   ↑↓ PgUp PgDn scroll"
_FRAME = 6
"""Lines that are neither links nor variables nor events: heads, rules, keys."""
_EVENTS = 4
_NARROW, _WIDE, _SPACIOUS = 80, 96, 124
"""Columns from which on generous columns, the places, and the robot's name, have room."""


class Show(Enum):
    """Which variables."""

    ALL = "all"
    INPUTS = "to the robot"
    OUTPUTS = "from the robot"


_NEXT = {Show.ALL: Show.INPUTS, Show.INPUTS: Show.OUTPUTS, Show.OUTPUTS: Show.ALL}
_DIRECTIONS = {Show.ALL: ("input", "output"), Show.INPUTS: ("input",), Show.OUTPUTS: ("output",)}


@dataclass(frozen=True, slots=True)
class Glimpse:
    """What the gateway answered at one moment."""

    status: Answer
    variables: Sequence[Answer]
    events: Sequence[Answer]
    lost: str = ""
    """Why it does not answer any more; the rest is then old."""


@dataclass(frozen=True, slots=True)
class View:
    """What the keys have chosen."""

    filter: str = ""
    typing: bool = False
    show: Show = Show.ALL
    only_bad: bool = False
    paused: bool = False
    top: int = 0
    """First variable shown."""
    page: int = field(default=10, compare=False)
    over: bool = False


def press(view: View, key: str) -> View:
    """The view after a key: a character, or the name of another key (`up`, `pgdn`, `esc`, `enter`, `backspace` ...)."""
    if view.typing:
        return _typed(view, key)
    match key:
        case "q" | "Q" | "\x03":
            return replace(view, over=True)
        case "/":
            return replace(view, typing=True, top=0)
        case "esc":
            return replace(view, filter="", top=0)
        case "d":
            return replace(view, show=_NEXT[view.show], top=0)
        case "b":
            return replace(view, only_bad=not view.only_bad, top=0)
        case " ":
            return replace(view, paused=not view.paused)
    step = {
        "up": -1,
        "k": -1,
        "down": 1,
        "j": 1,
        "pgup": -view.page,
        "pgdn": view.page,
        "home": -(10**6),
        "end": 10**6,
    }
    return replace(view, top=max(0, view.top + step.get(key, 0)))


def _typed(view: View, key: str) -> View:
    match key:
        case "enter":
            return replace(view, typing=False)
        case "esc":
            return replace(view, typing=False, filter="")
        case "backspace":
            return replace(view, filter=view.filter[:-1])
        case "\x03":
            return replace(view, over=True)
    return replace(view, filter=view.filter + key) if len(key) == 1 and key.isprintable() else view


def chosen(variables: Sequence[Answer], view: View) -> list[Answer]:
    """The variables whose name, robot register or owner contains the filter, and that are asked for."""
    wanted, directions = view.filter.lower(), _DIRECTIONS[view.show]
    return [
        variable
        for variable in variables
        if variable["direction"] in directions
        and not (view.only_bad and variable["quality"] == "good")
        and any(
            wanted in text.lower() for text in (variable["name"], variable["robot"], variable["owner"] or "")
        )
    ]


def settled(view: View, glimpse: Glimpse, height: int) -> View:
    """The view with its page as high as the screen allows, and scrolled no further than there is anything."""
    page = _page_height(glimpse, height)
    last = max(0, len(chosen(glimpse.variables, view)) - page)
    return replace(view, page=page, top=min(view.top, last))


def _page_height(glimpse: Glimpse, height: int) -> int:
    """How many variables a screen of `height` lines has room for."""
    return max(1, height - _FRAME - _EVENTS - len(glimpse.status.get("cells", ())))


def screen(glimpse: Glimpse, before: Glimpse | None, view: View, width: int) -> Group:
    """One picture of a `settled` view; values that differ from `before` are bright."""
    variables = chosen(glimpse.variables, view)
    room, top = view.page, view.top
    former = before.variables if before is not None else ()
    old = {(variable["cell"], variable["name"]): variable["value"] for variable in former}
    shown = variables[top : top + room]
    parts: list[RenderableType] = [_head(glimpse, view), *_links(glimpse)]
    parts.append(_table(shown, old, glimpse, width))
    parts += [Text("")] * (room - len(shown))
    parts += [_range(top, len(shown), len(variables), view, width), *_events(glimpse), _keys(view)]
    return Group(*parts)


def plain(glimpse: Glimpse, view: View) -> str:
    """One block of lines, for everything that is no terminal."""
    lines = [f"{glimpse.status.get('time', '')} " + (glimpse.lost or _health(glimpse.status))]
    lines += [f"  {cell['name']}: {_link_words(cell)}" for cell in glimpse.status.get("cells", ())]
    variables = chosen(glimpse.variables, view)
    if not variables and not glimpse.lost:
        lines.append("  no variable matches")
    for variable in variables:
        arrow = "->" if variable["direction"] == "input" else "<-"
        shown = f"{variable['name']:<20} {phrases.value(variable):>14}"
        state = f"{phrases.quality(variable['quality']):<12} {age(variable['age']):>9}"
        lines.append(f"  {arrow} {shown}  {state}  {phrases.owner(variable)}".rstrip())
    return "\n".join([*lines, ""])


def _head(glimpse: Glimpse, view: View) -> Text:
    text = Text(no_wrap=True, overflow="ellipsis")
    if glimpse.lost:
        return text.append(f" everything below is old: {glimpse.lost} ", "bold white on red")
    status = glimpse.status
    colour = "green" if status["healthy"] else "red"
    text.append(f" gatewayd {status['version']} ", "bold").append(_health(status), f"bold {colour}")
    if view.paused:
        text.append("  PAUSED: everything below is old ", "bold black on yellow")
    return text


def _health(status: Answer) -> str:
    if status["healthy"]:
        return "healthy"
    first, *more = status["problems"]
    return f"degraded: {first}" + (f" (and {len(more)} more)" if more else "")


def _links(glimpse: Glimpse) -> Iterator[Text]:
    for cell in glimpse.status.get("cells", ()):
        style = "dim" if glimpse.lost else LEVEL_COLOURS[SOURCE_LEVELS[source(cell["robot"]["state"])]]
        text = Text(no_wrap=True, overflow="ellipsis").append(" ● ", style).append(cell["name"], "bold")
        yield text.append(f"  {_link_words(cell)}")


def _link_words(cell: Answer) -> str:
    robot, writes = cell["robot"], cell["writes"]
    rate = f" at {robot['frequency']:g} Hz" if robot["state"] == "fresh" and robot["frequency"] else ""
    words = [f"robot {robot['state']}{rate}, age {age(robot['age'])}"]
    words += [f"{link['name']} {link['words']}" for link in cell["links"] if link["name"] != "robot"]
    there = [writer["name"] for writer in cell["writers"] if writer["alive"]]
    words.append(f"{', '.join(there)} connected" if there else "no writer connected")
    words.append(f"writes {writes['accepted']} accepted, {writes['refused']} refused")
    return "   ".join(words)


def _table(shown: Sequence[Answer], old: Mapping[Any, Any], glimpse: Glimpse, width: int) -> Table:
    table = Table(
        box=box.SIMPLE_HEAD,
        padding=(0, 1 if width < _NARROW else 2, 0, 0),
        pad_edge=False,
        expand=False,
        show_edge=False,
    )
    several = len(glimpse.status.get("cells", ())) > 1
    narrow = width < _NARROW
    longest = max((len(phrases.value(variable)) for variable in shown), default=0)
    table.add_column(
        "   variable", no_wrap=True, min_width=None if narrow else 18, max_width=16 if narrow else 32
    )
    table.add_column("value", justify="right", no_wrap=True, min_width=max(5 if narrow else 10, longest))
    table.add_column("quality", no_wrap=True, min_width=6 if narrow else 12)
    table.add_column("age", justify="right", no_wrap=True, min_width=6 if narrow else 7)
    table.add_column("owner", no_wrap=True, min_width=5 if narrow else 18, max_width=14 if narrow else None)
    if width >= _WIDE:
        table.add_column("places", no_wrap=True, min_width=8, max_width=24)
    if width >= _SPACIOUS:
        table.add_column("robot register", no_wrap=True)
    for variable in shown:
        table.add_row(*_cells(variable, old, width, several=several), style="dim" if glimpse.lost else "")
    return table


def _cells(variable: Answer, old: Mapping[Any, Any], width: int, *, several: bool) -> Iterator[Text]:
    towards = variable["direction"] == "input"
    colour = "cyan" if towards else "green"
    name = f"{variable['cell']}:{variable['name']}" if several else variable["name"]
    yield Text(" → " if towards else " ← ", f"bold {colour}").append(name, "bold default")
    changed = old.get((variable["cell"], variable["name"]), variable["value"]) != variable["value"]
    yield Text(phrases.value(variable), "bold yellow" if changed else "bold")
    yield Text(phrases.quality(variable["quality"]), QUALITY_COLOURS[quality(variable["quality"])])
    yield Text(age(variable["age"]), "dim")
    style = (
        "magenta"
        if variable["forced"] or variable["owner"] == "operator"
        else "yellow"
        if variable["lease"]
        else ""
    )
    yield Text(phrases.owner(variable), style if towards or variable["forced"] else "dim")
    if width >= _WIDE:
        yield Text(phrases.places(variable), "dim")
    if width >= _SPACIOUS:
        yield Text(variable["robot"], "dim")


_ONLY_WIDE = {"places": _WIDE, "robot register": _SPACIOUS}
"""Columns that a narrow screen leaves out, and the width that each needs."""


def _range(top: int, shown: int, found: int, view: View, width: int) -> Text:
    text = Text(" ", no_wrap=True, overflow="ellipsis")
    text.append(
        f"{top + 1}-{top + shown} of {found}" if shown else "no variable matches",
        "dim" if shown else "yellow",
    )
    text.append(f"   direction: {view.show.value}" if view.show is not Show.ALL else "", "cyan")
    text.append("   only bad" if view.only_bad else "", "cyan")
    if view.typing:
        text.append(f"   filter: {view.filter}▏", "bold yellow")
    elif view.filter:
        text.append(f"   filter: {view.filter}", "yellow")
    left_out = [name for name, needed in _ONLY_WIDE.items() if width < needed]
    return text.append(f"   wider: {', '.join(left_out)}" if left_out else "", "dim")


def _events(glimpse: Glimpse) -> Iterator[Text]:
    latest = glimpse.events[-_EVENTS:]
    for event in latest:
        text = Text(f" {phrases.clock(event['time'])} ", "dim", no_wrap=True, overflow="ellipsis")
        yield text.append(event["text"], "yellow" if event["bad"] else "default")
    yield from (Text("") for _ in range(_EVENTS - len(latest)))


def _keys(view: View) -> Text:
    keys = "type to filter by name, register or owner   Enter keep   Esc clear" if view.typing else KEYS
    return Text(f" {keys}", "reverse", no_wrap=True, overflow="ellipsis")
