"""How the demonstration looks: a table that follows a terminal, or plain lines for everything else."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from gatewayd.demo.snapshot import Snapshot, TableLine
from gatewayd.report.format import counted
from gatewayd.report.screen import wrapped
from gatewayd.report.words import QUALITY_COLOURS

Poke = tuple[str, str]
"""What a command shows, and the command."""

_TINY, _NARROW, _WIDE = 60, 80, 98
"""Columns of a terminal that has room for the Modbus address and the age, for the robot's register, for CANopen."""
_SPACIOUS = 115
"""Columns of one that has room for everything, the 4xxxxx form among it."""
_MIN_EVENTS, _MOST_EVENTS = 3, 8
_FRAME_OF_TABLE = 5
"""Lines of the table that are no variables: title, rules and blank ones."""
_EDGES = 2
"""Blank ones above and below it, which a small window spares."""
_FRAME_OF_POKES = 2
_ABOVE = 4
"""Lines that are left to what was printed before."""


def commands(port: int, python: str) -> tuple[list[Poke], Poke]:
    """What to type in another terminal, with mbpoll and with nothing but this Python."""
    mbpoll = f"mbpoll -0 -p {port}"
    script = (
        f"import pymodbus.client as m; c = m.ModbusTcpClient('127.0.0.1', port={port}); c.connect(); "
        "print(c.write_register(10, 50))"
    )
    return [
        ("watch part_done and cycles", f"{mbpoll} -t 4:int -B -r 101 -c 2 127.0.0.1"),
        ("meanwhile: half speed, yours for 5 s", f"{mbpoll} -r 10 127.0.0.1 50"),
        ("try to change the order: refused, 06", f"{mbpoll} -r 1 127.0.0.1 7"),
    ], ("Half speed for 5 s without mbpoll", f'{python} -c "{script}"')


def screen(shot: Snapshot, before: Snapshot | None, pokes: Sequence[Poke], width: int, height: int) -> Group:
    """One picture of at most `height` lines; values that differ from `before` are bright."""
    old = {line.row.number: line.value for line in before.lines} if before is not None else {}
    links = [line for text in _parties(shot, width) for line in wrapped(text, width)]
    fixed, wanted = len(links) + _FRAME_OF_TABLE + len(shot.lines), _MIN_EVENTS + len(pokes) + _FRAME_OF_POKES
    spares_edges = width < _NARROW or height < fixed + wanted
    fixed -= _EDGES if spares_edges else 0
    table = _table(shot.lines, old, width, has_edges=not spares_edges)
    shown = list(pokes) if height >= fixed + wanted and width >= _width_of(pokes) else []
    room = height - fixed - (len(shown) + _FRAME_OF_POKES if shown else 0) - _ABOVE
    # A small window gives one event's line to the hint.
    events = min(max(room, _MIN_EVENTS) - (not shown), _MOST_EVENTS)
    left_out = ", ".join(name for name, needed in _NEEDED.items() if width < needed)
    hints = list(_hints(shown, left_out)) if shown else wrapped(_hint(pokes[1], left_out), width)
    if spares_edges and not shown:
        # As many as fit below a table that is never cut; there may be none.
        events = max(0, min(height - fixed - len(hints) - 1, _MOST_EVENTS))
    return Group(*links, table, *_events(shot, events, width), *hints)


def plain(shot: Snapshot) -> str:
    """One block of lines."""
    health, program, master = shot.health, shot.plc.program, shot.master
    links = (
        f"{shot.elapsed:6.1f} s  robot {shot.robot}, {health.frequency:.1f} Hz, {counted(health.packages, 'package')}, "
        f"{health.skipped} skipped | plc {program.phase.value}, {counted(program.handshakes, 'handshake')}, "
        f"{counted(program.verified, 'value')} verified | "
        f"writes {health.writes_accepted} accepted, {health.writes_refused} refused\n"
        f"          node {shot.node}, {counted(master.heartbeats, 'heartbeat')}, {shot.pdo_rate} PDOs/s | "
        f"line {counted(master.sent, 'RPDO')}, {counted(master.feeder.verified, 'value')} verified, "
        f"{master.emergencies} EMCY\n"
        f"          island {_island_words(shot)}"
    )
    lines = [
        f"  {'->' if line.row.direction == 'input' else '<-'} {line.row.name:<12} {line.row['robot']:<25} "
        f"{line.address:>6} {line.row['notation']:<9} {line.row['object']:<8} {line.row['cob_id']:<5}"
        f"{line.value:>9}  {line.quality.name.lower():<12}"
        f"{line.age:>7}  {_owner(line)}".rstrip()
        for line in shot.lines
    ]
    return "\n".join([links, *lines, *(f"  {event.clock} {event.text}" for event in shot.events[-3:]), ""])


def _parties(shot: Snapshot, width: int) -> list[Text]:
    """Who takes part, and how it goes: two to a line, or each on its own where there is no room for two."""
    robot, plc = _links(shot, width)
    node, line = _canopen(shot, spacious=width >= _SPACIOUS)
    island = _party("island", _island_words(shot), good=shot.island_answers)
    if width < _TINY:
        # What it does stands in the table.
        return [Text("  ").join((robot, _party("island", "", good=shot.island_answers))), plc, node, line]
    if width < _NARROW:
        return [robot, plc, node, line, island]
    return [*(Text("  ").join((left, right)) for left, right in ((robot, plc), (node, line))), island]


def _links(shot: Snapshot, width: int) -> tuple[Text, Text]:
    health, program, spacious = shot.health, shot.plc.program, width >= _SPACIOUS
    rate = f"{health.frequency:.1f} Hz" if shot.fresh and health.frequency else shot.robot
    packages = f", {counted(health.packages, 'package')}, {health.skipped} skipped" if spacious else ""
    robot = _party("robot", rate + packages, good=shot.fresh)
    right = f", {counted(program.verified, 'value')} right" if width >= _TINY else ""
    right = counted(program.handshakes, "handshake") + right
    text = _party("PLC", right, len(program.wrong), good=shot.plc.connected)
    text.append(f"   {counted(health.writes_accepted, 'write')}, " if spacious else "   ")
    return robot, text.append(f"{health.writes_refused} refused", "bold red" if health.writes_refused else "")


def _canopen(shot: Snapshot, *, spacious: bool) -> tuple[Text, Text]:
    master, good, wrong = shot.master, shot.operational, len(shot.master.feeder.wrong)
    beats = f"{counted(master.heartbeats, 'heartbeat')}, " if spacious else ""
    node = _party("CANopen", f"{shot.node}, {beats}{shot.pdo_rate} PDOs/s", good=good)
    sent = f"{counted(master.sent, 'RPDO')}, " if spacious else ""
    right = f"{sent}{counted(master.feeder.verified, 'value')} right"
    text = _party("line", right, wrong, good=good and not wrong)
    return node, text.append("   ").append(
        f"{master.emergencies} EMCY", "bold red" if master.emergencies else ""
    )


def _island_words(shot: Snapshot) -> str:
    """`19 requests/s   part there, clamped`."""
    part = "part there" if shot.part_there else "no part"
    return f"{shot.island_rate} requests/s   {part}, {'clamped' if shot.terminals.clamp else 'not clamped'}"


def _party(name: str, words: str, wrong: int = 0, *, good: bool) -> Text:
    """A party to the demonstration, with a dot that says how it is."""
    text = Text().append(" ● ", "green" if good else "red")
    text.append(f"{name} ", "bold").append(words)
    return text.append(f", {wrong} wrong", "bold red") if wrong else text


_COLUMNS: Sequence[tuple[str, Literal["left", "right"], int]] = (
    ("   variable", "left", 14),
    ("robot register", "left", 0),
    ("Modbus", "right", 6),
    ("4xxxxx", "left", 0),
    ("CANopen", "left", 0),
    ("PDO", "left", 0),
    ("value", "right", 7),
    ("state", "left", 5),
    ("age", "right", 6),
    ("owner", "left", 16),
)
"""Head, side and least width."""
_OF_LEASE = len(" left")
_NEEDED: Mapping[str, int] = {
    "4xxxxx": _SPACIOUS,
    "CANopen": _WIDE,
    "PDO": _WIDE,
    "robot register": _NARROW,
    "Modbus": _TINY,
    "age": _TINY,
}
"""Columns for which a terminal has to be so wide."""


def _table(lines: Sequence[TableLine], old: dict[int, str], width: int, *, has_edges: bool) -> Table:
    spacious = width >= _SPACIOUS
    table = Table(box=box.SIMPLE_HEAD, padding=(0, int(spacious), 0, 0), pad_edge=False, show_edge=has_edges)
    for name, justify, least in _COLUMNS:
        if width >= _NEEDED.get(name, 0):
            head = "quality" if name == "state" and spacious else name
            spared = _OF_LEASE if name == "owner" and width < _TINY else 0
            table.add_column(head, justify=justify, no_wrap=True, min_width=least - spared)
    previous = lines[0].row.direction if lines else ""
    for line in lines:
        if line.row.direction != previous:
            if has_edges or width >= _NARROW:
                table.add_section()
            previous = line.row.direction
        changed = old.get(line.row.number, line.value) != line.value
        cells = _cells(line, changed=changed, width=width)
        table.add_row(*(cell for name, cell in cells if width >= _NEEDED.get(name, 0)))
    return table


def _cells(line: TableLine, *, changed: bool, width: int) -> Iterator[tuple[str, Text]]:
    """By name of the column."""
    towards = line.row.direction == "input"
    colour = "cyan" if towards else "green"
    yield (
        "   variable",
        Text(" → " if towards else " ← ", f"bold {colour}").append(line.row.name, "bold default"),
    )
    # Where there is no room for all of the name, its number must not be what is cut.
    robot = line.row["robot"]
    yield "robot register", Text(robot if width >= _WIDE else robot.replace("_register_", " "), colour)
    yield "Modbus", Text(line.address)
    yield "4xxxxx", Text(line.row["notation"], "dim")
    yield "CANopen", Text(line.row["object"])
    yield "PDO", Text(line.row["cob_id"] or ("SDO" if line.row["object"] else ""), "dim")
    yield "value", Text(line.value, "bold yellow" if changed and line.row.name != "tool_height" else "bold")
    yield "state", Text(line.quality.name.lower(), QUALITY_COLOURS[line.quality])
    yield "age", Text(line.age, "dim")
    if line.refused:
        # The answer says it all where there is no room: 06, FF01h.
        yield "owner", Text(line.refused.rpartition(": ")[2] if width < _TINY else line.refused, "bold red")
    else:
        owner = _owner(line) if width >= _TINY else _owner(line).removesuffix(" left")
        yield "owner", Text(owner, "yellow" if line.lease else "" if towards else "dim")


def _owner(line: TableLine) -> str:
    if line.refused:
        return f"{line.owner or 'free'} ({line.refused})"
    return f"{line.owner}, {line.lease} left" if line.lease else line.owner or "free"


def _events(shot: Snapshot, count: int, width: int) -> Iterator[Text]:
    """`count` lines of the latest events, then empty ones, so that the picture keeps its height."""
    lines: list[Text] = []
    for event in reversed(shot.events):
        text = Text(f" {event.clock} ", "dim").append(event.text, "bold red" if event.bad else "default")
        broken = wrapped(text, width)
        if len(lines) + len(broken) > count:
            break
        lines[:0] = broken
    yield from lines
    yield from (Text("") for _ in range(count - len(lines)))


def _hint(poke: Poke, left_out: str) -> Text:
    """What a small window has room for, and the columns for which it has none."""
    text = Text(" try: ", "dim")
    return text.append(poke[1], "bold cyan").append(
        f"   wider: {left_out}" if left_out else "   more in a taller window", "dim"
    )


def _hints(pokes: Sequence[Poke], left_out: str) -> Iterator[Text]:
    yield Text(f" In a window of {_SPACIOUS} columns: {left_out}" if left_out else "", "dim")
    yield Text(" From another terminal (mbpoll: apt install mbpoll), Ctrl-C ends:", "dim")
    wide = _widest(pokes)
    for meaning, command in pokes:
        text = Text(f" {meaning:<{wide}}  ", no_wrap=True, overflow="ellipsis")
        yield text.append(command, "bold cyan")


def _widest(pokes: Sequence[Poke]) -> int:
    return max(len(meaning) for meaning, _ in pokes)


def _width_of(pokes: Sequence[Poke]) -> int:
    """Columns of a window in which no command is cut."""
    return _widest(pokes) + 3 + max(len(command) for _, command in pokes)
