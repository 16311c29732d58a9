"""What can be seen of the demonstration at one moment, as texts: the rows of the table, the links, the events."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

from gatewayd.audit.record import utc
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.health import Health
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.demo.island import Terminals
from gatewayd.demo.master import Master
from gatewayd.demo.plc import Plc
from gatewayd.demo.scene import Scene
from gatewayd.report.event_text import BAD, UNDECLARED_PEER, EventRecord
from gatewayd.report.format import age, value
from gatewayd.report.layout import Row
from gatewayd.report.words import SOURCES

REFUSAL_SHOWN = 5.0
"""Seconds for which a refusal of a Modbus client stands beside its variable."""
PDO_REFUSAL_SHOWN = 1.5
"""The same for a refused PDO, which its sender repeats by itself."""
EVENTS_KEPT = 8
ROBOT = "robot"
"""Who owns an output."""

_EXCEPTIONS = {
    Reason.NO_SUCH_ADDRESS: "02",
    Reason.NOT_WRITABLE: "02",
    Reason.HELD: "06",
    Reason.OUT_OF_LIMITS: "03",
    Reason.PARTIAL_VALUE: "03",
    Reason.ROBOT_LOST: "0B",
    Reason.CLAIMED_ELSEWHERE: "0A",
    Reason.HEARTBEAT_LOST: "0B",
    Reason.PARTIAL_TAKEOVER: "03",
    Reason.WAITED: "06",
    Reason.NOT_MEANT: "06",
    Reason.CONTRADICTED: "03",
    Reason.NOT_IN_ROLE: "01",
}
_EMERGENCIES = {
    Reason.NOT_WRITABLE: "FF05h",
    Reason.HELD: "FF01h",
    Reason.OUT_OF_LIMITS: "FF02h",
    Reason.ROBOT_LOST: "FF03h",
    Reason.CLAIMED_ELSEWHERE: "FF04h",
    Reason.HEARTBEAT_LOST: "FF06h",
    Reason.PARTIAL_TAKEOVER: "FF07h",
    Reason.WAITED: "FF08h",
    Reason.CONTRADICTED: "FF09h",
}
_STATES = {
    None: "not heard yet",
    0: "booting",
    4: "stopped",
    5: "operational",
    127: "pre-operational",
}


@dataclass(frozen=True, slots=True)
class TableLine:
    """One row of the table."""

    row: Row
    address: str
    value: str
    quality: Quality
    age: str
    owner: str
    lease: str
    """What is left of the owner's lease; empty without one."""
    refused: str
    """Who was refused here lately, and with which exception or EMCY."""


@dataclass(frozen=True, slots=True)
class ShownEvent:
    """One event in words."""

    clock: str
    text: str
    bad: bool


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything at one moment. What the parties count themselves is read from them when it is drawn."""

    elapsed: float
    robot: str
    """State of the robot in a few words."""
    fresh: bool
    health: Health
    plc: Plc
    master: Master
    node: str
    """NMT state of the node as the CANopen master hears it."""
    operational: bool
    pdo_rate: int
    """PDOs per second from the node."""
    terminals: Terminals
    """The island's."""
    island_answers: bool
    """Whether the gateway is connected to it."""
    island_rate: int
    """Requests per second."""
    part_there: bool
    """What its sensor sees."""
    lines: tuple[TableLine, ...]
    events: tuple[ShownEvent, ...]
    """The latest last."""


def snapshot(scene: Scene, now: float) -> Snapshot:
    """All that is shown, at monotonic time `now`."""
    cell, master = scene.cell, scene.master
    latest = [event for event in cell.events if event.kind not in _LEFT_OUT][-EVENTS_KEPT:]
    started_at = time.time() - now
    events = [
        ShownEvent(
            _clock(started_at + event.time), describe(event, cell, scene.can_writer), event.kind.value in BAD
        )
        for event in latest
    ]
    events += [ShownEvent(_clock(started_at + now), problem, bad=True) for problem in scene.problems]
    return Snapshot(
        elapsed=now - scene.started,
        robot=SOURCES[cell.freshness.state],
        fresh=cell.freshness.state is Source.FRESH,
        health=cell.health,
        plc=scene.plc,
        master=master,
        node=_STATES.get(master.state, "unknown") if master.state is None or master.lives(now) else "lost",
        operational=master.operational(now),
        pdo_rate=master.rate(now),
        terminals=scene.island.terminals,
        island_answers=scene.island.connections > 0,
        island_rate=scene.island.terminals.rate(now),
        part_there=scene.island.terminals.part_there(now),
        lines=tuple(_line(cell, row, scene.can_writer, now) for row in scene.rows),
        events=tuple(events),
    )


def describe(event: Event, cell: Cell, can_writer: int | None = None) -> str:
    """The event in words: `you wrote part_number = 7: refused with exception 06, held by plc`.

    `can_writer` hears of refusals by EMCY, everybody else by exceptions.
    """
    record = EventRecord.of(event, cell.definition)
    if not isinstance(event.reason, Reason):
        return record.text()
    return record.text(f"refused with {_answer(event.reason, event.writer, can_writer)}")


_LEFT_OUT = {EventKind.AVAILABLE}


def _answer(reason: Reason, writer: int | None, can_writer: int | None) -> str:
    if writer is not None and writer == can_writer:
        return f"EMCY {_EMERGENCIES.get(reason, '')}".rstrip()
    return f"exception {_EXCEPTIONS[reason]}"


def _line(cell: Cell, row: Row, can_writer: int | None, now: float) -> TableLine:
    index = row.number - 1
    variable = cell.definition.variables[index]
    owner, lease = ROBOT if variable.direction is Direction.OUTPUT else "", ""
    if variable.lock is not None:
        holder = cell.ownership.owners[variable.lock]
        if holder is not None:
            owner = cell.definition.writer_name(holder)
            left = cell.ownership.remaining(variable.lock, now)
            lease = f"{left:.1f} s" if left < math.inf else ""
    return TableLine(
        row=row,
        address=_address(row),
        value=value(cell.image.values[index], row.unit),
        quality=cell.image.quality[index],
        age=age(cell.image.age(index, now)),
        owner=owner,
        lease=lease,
        refused=_refused(cell, index, can_writer, now),
    )


def _address(row: Row) -> str:
    """Its register or bit in the gateway's own server, where it has one."""
    if row["address"] is None:
        return ""
    return f"{row['address']}" if row["bit"] is None else f"{row['address']}.{row['bit']}"


def _refused(cell: Cell, index: int, can_writer: int | None, now: float) -> str:
    last = cell.last_refusal
    if last is None or last.refusal.variable != index:
        return ""
    by_pdo = last.writer is not None and last.writer == can_writer
    if now - last.time > (PDO_REFUSAL_SHOWN if by_pdo else REFUSAL_SHOWN):
        return ""
    writer = cell.definition.writer_name(last.writer) if last.writer is not None else UNDECLARED_PEER
    if by_pdo:
        return f"{writer}: {_EMERGENCIES.get(last.refusal.reason, 'refused')}"
    return f"{writer} refused: {_EXCEPTIONS[last.refusal.reason]}"


def _clock(at: float) -> str:
    """`02:15:07.042Z`, as the log and the commands have it."""
    return utc(at).partition("T")[2]
