"""How `gatewayd watch` looks, and what its keys do. Pure: answers and a view in, a picture out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from rich.console import Group
from rich.text import Text

from gatewayd.cli import phrases
from gatewayd.cli.watch_table import Answer, TableLayout, layout
from gatewayd.report.format import age
from gatewayd.report.screen import wrapped
from gatewayd.report.words import LEVEL_COLOURS, SOURCE_LEVELS, source

KEYS = "q quit   / filter   Esc clear   d direction   b only bad   space pause   ↑↓ PgUp PgDn scroll"
_SHORTER_KEYS = (
    "q quit   / filter   Esc clear   d b space ↑↓ PgUp PgDn",
    "q / filter Esc d b space ↑↓ PgUp PgDn",
)
_HEAD_OF_TABLE, _SPARE = 2, 1
_EVENTS = 4
_LOW = 20
"""Lines of a screen that is too low for more than the last event."""


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
    """Variables that are shown at one time."""
    room: int = field(default=10, compare=False)
    """Lines for them."""
    events: int = field(default=_EVENTS, compare=False)
    """Lines for events."""
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


def settled(view: View, glimpse: Glimpse, width: int, height: int) -> View:
    """The view with its page as high as the screen allows, and scrolled no further than there is anything."""
    variables = chosen(glimpse.variables, view)
    found = _layout(variables, glimpse, width)
    above = len(_above(glimpse, view, width)) + _HEAD_OF_TABLE
    below = len(_range(_where(0, len(variables), len(variables)), view, found, width)) + 1
    events = _EVENTS if height >= _LOW else 1
    room = max(1, height - above - below - events - _SPARE)
    last = len(variables) - found.shown(variables[::-1], room)
    top = max(0, min(view.top, last))
    page = found.shown(variables[top:], room)
    return replace(view, page=max(1, page), room=room, events=events, top=top)


def _layout(variables: Sequence[Answer], glimpse: Glimpse, width: int) -> TableLayout:
    return layout(variables, width, several=len(glimpse.status.get("cells", ())) > 1)


def screen(glimpse: Glimpse, before: Glimpse | None, view: View, width: int) -> Group:
    """One picture of a `settled` view; values that differ from `before` are bright."""
    variables = chosen(glimpse.variables, view)
    top = view.top
    former = before.variables if before is not None else ()
    old = {(variable["cell"], variable["name"]): variable["value"] for variable in former}
    shown = variables[top : top + view.page]
    found = _layout(variables, glimpse, width)
    empty = view.room - sum(map(found.height, shown))
    return Group(
        *_above(glimpse, view, width),
        found.table(shown, old, "dim" if glimpse.lost else ""),
        *[Text("")] * empty,
        *_range(_where(top, len(shown), len(variables)), view, found, width),
        *_events(glimpse, view.events, width),
        _keys(view, width),
    )


def _where(top: int, shown: int, found: int) -> str:
    return f"{top + 1}-{top + shown} of {found}" if shown else ""


def _above(glimpse: Glimpse, view: View, width: int) -> list[Text]:
    return [line for text in (_head(glimpse, view), *_links(glimpse)) for line in wrapped(text, width)]


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
    text = Text()
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
        text = Text().append(" ● ", style).append(cell["name"], "bold")
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


def _range(where: str, view: View, table: TableLayout, width: int) -> list[Text]:
    text = Text(" ").append(where or "no variable matches", "dim" if where else "yellow")
    text.append(f"   direction: {view.show.value}" if view.show is not Show.ALL else "", "cyan")
    text.append("   only bad" if view.only_bad else "", "cyan")
    if view.typing:
        text.append(f"   filter: {view.filter}▏", "bold yellow")
    elif view.filter:
        text.append(f"   filter: {view.filter}", "yellow")
    text.append(f"   wider: {', '.join(table.left_out)}" if table.left_out else "", "dim")
    return wrapped(text, width)


def _events(glimpse: Glimpse, count: int, width: int) -> list[Text]:
    """The latest, in `count` lines, the last of them at the bottom; of the newest at least its beginning."""
    lines: list[Text] = []
    for event in reversed(glimpse.events):
        text = Text(f" {phrases.clock(event['time'])} ", "dim")
        broken = wrapped(text.append(event["text"], "yellow" if event["bad"] else "default"), width)
        if lines and len(lines) + len(broken) > count:
            break
        lines[:0] = broken
    return lines[:count] + [Text("")] * (count - len(lines))


def _keys(view: View, width: int) -> Text:
    typing = (
        "type to filter by name, register or owner   Enter keep   Esc clear",
        "type   Enter keep   Esc clear",
    )
    keys = typing if view.typing else (KEYS, *_SHORTER_KEYS)
    shown = next((text for text in keys if len(text) < width), keys[-1])
    return Text(f" {shown}", "reverse", no_wrap=True, overflow="crop")
