"""The register table of a cell: what lies where, who may write it, and what is seen when a side is lost."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from gatewayd.core.definition import Direction, Fallback
from gatewayd.links.canopen_node.expand import node_of
from gatewayd.links.canopen_node.pdo_table import as_document, load_by_bit_rate, object_place, pdo_rows
from gatewayd.links.modbus_server.expand import ExpandedPlacement, placements_of
from gatewayd.links.modbus_server.plan import modbus_of
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.areas import AREA_NAMES
from gatewayd.report.printable import json_text, printable
from gatewayd.report.wording import cob, seconds

__all__ = [
    "COLUMNS",
    "Row",
    "as_csv",
    "as_json",
    "as_markdown",
    "by_line",
    "formula",
    "limits",
    "lost",
    "policy",
    "rows",
]


@dataclass(frozen=True, slots=True)
class Row:
    """One variable at one place; a variable with several places has several rows, one with none has one."""

    number: int
    """As the status block counts the variable, from 1."""
    name: str
    direction: str
    """`input` (fieldbus to robot) or `output` (robot to fieldbus)."""
    robot: str
    """What it is in the robot: `input_bit_register_5`, `actual_TCP_pose[0]`."""
    area: str
    """`holding`, `input`, `coil`, `discrete`; empty for a variable without a place."""
    address: int | None
    """Protocol address from 0."""
    bit: int | None
    """Bit of the register, 0 the least significant."""
    notation: str
    """The 4xxxxx form, with the bit where there is one."""
    words: int
    """Addresses covered."""
    type: str
    order: str
    """Byte order; empty for bits."""
    scale: float | None
    """Robot value = raw * scale + offset; None for bits."""
    offset: float | None
    unit: str
    low: float | None
    """Limits in the robot's unit; None where there are none."""
    high: float | None
    clamp: bool
    owner: str
    """Writers by priority, `plc > hmi` where the first takes over, else `plc, hmi`; `any`; empty for outputs."""
    lease: float | None
    """Seconds; None for no lease."""
    takeover: bool
    group: str
    on_release: str
    """Inputs: what the robot is given when the owner is lost."""
    on_stale: str
    """Outputs: what the fieldbus sees when the robot stops telling."""
    comment: str
    object: str = ""
    """CANopen object, `2000h:01`; empty where there is none."""
    can_type: str = ""
    """Its CiA 301 type."""
    pdo: str = ""
    """PDO that carries it, `TPDO 3`; empty where none does."""
    cob_id: str = ""
    """COB-ID of the PDO, `0x190`."""
    pdo_bit: int | None = None
    """Where it begins in the PDO, 0 the least significant bit of the first byte."""
    whole: bool = False
    """Whether its group is taken over only by writing all of it."""
    valid: str = ""
    """`running`: good only while the robot program runs; empty: always."""


COLUMNS = tuple(field.name for field in dataclasses.fields(Row))


def rows(cell: ExpandedCell) -> tuple[Row, ...]:
    """The table of a cell without errors, in file order."""
    placed: dict[int, list[ExpandedPlacement]] = {}
    for placement in placements_of(cell):
        placed.setdefault(placement.variable.index, []).append(placement)
    on_can = _canopen(cell)
    found: list[Row] = []
    for variable in cell.variables:
        places: Sequence[ExpandedPlacement | None] = placed.get(variable.index) or [None]
        found.extend(_row(cell, variable, place, on_can.get(variable.index, {})) for place in places)
    return tuple(found)


def _canopen(cell: ExpandedCell) -> dict[int, dict[str, Any]]:
    """What the CANopen columns hold, by variable."""
    node = node_of(cell)
    if node is None:
        return {}
    columns: dict[int, dict[str, Any]] = {
        one.variable: {"object": object_place(one), "can_type": one.plan.type.name} for one in node.objects
    }
    for pdo in node.pdos:
        assert pdo.slot.cob_id is not None
        for bit, one in pdo.offsets:
            columns[one.variable] |= {"pdo": pdo.label, "cob_id": cob(pdo.slot.cob_id), "pdo_bit": bit}
    return columns


def by_line(cell: ExpandedCell) -> tuple[tuple[Row, Row], ...]:
    """The table with one entry for each line of the file and place: its first and its last row."""
    ends: dict[tuple[str, int], tuple[Row, Row]] = {}
    placed: dict[int, int] = {}
    variables = {variable.index + 1: variable for variable in cell.variables}
    for row in rows(cell):
        place = placed[row.number] = placed.get(row.number, -1) + 1
        key = variables[row.number].part.name, place
        first, _ = ends.setdefault(key, (row, row))
        ends[key] = first, row
    return tuple(ends.values())


def _row(
    cell: ExpandedCell,
    variable: ExpandedVariable,
    place: ExpandedPlacement | None,
    canopen: dict[str, Any],
) -> Row:
    spec = variable.spec
    lock = cell.locks[variable.lock] if variable.lock is not None else None
    is_number = place is not None and place.codec is not None
    low, high = spec.limits if spec.limits is not None else (None, None)
    is_input = variable.direction is Direction.INPUT
    return Row(
        number=variable.index + 1,
        name=variable.name,
        direction=variable.direction.value,
        robot=variable.target,
        area=AREA_NAMES[place.area] if place is not None else "",
        address=place.address if place is not None else None,
        bit=place.bit if place is not None else None,
        notation=place.notation if place is not None else "",
        words=place.words if place is not None else 0,
        type=place.type if place is not None else "",
        order=place.order if place is not None and is_number else "",
        scale=place.scale if place is not None and is_number else None,
        offset=place.offset if place is not None and is_number else None,
        unit=spec.unit,
        low=low,
        high=high,
        clamp=spec.clamp,
        owner=""
        if lock is None
        else "any"
        if lock.is_any
        else (" > " if lock.takeover else ", ").join(lock.owners),
        lease=lock.lease if lock is not None else None,
        takeover=lock is not None and lock.takeover,
        group=lock.name if lock is not None and lock.group is not None else "",
        on_release=_fallback(spec.on_release) if is_input else "",
        on_stale="" if is_input else _fallback(spec.on_stale),
        comment=spec.comment,
        whole=lock is not None and lock.whole,
        valid="running" if variable.valid_running else "",
        **canopen,
    )


def _fallback(fallback: Fallback) -> str:
    if fallback.value is None:
        return fallback.kind.value
    return str(fallback.value).lower() if isinstance(fallback.value, bool) else f"{fallback.value:.10g}"


def as_csv(table: Sequence[Row]) -> str:
    """Comma separated values with a head line; what does not apply is empty, truth is true or false."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([_plain(getattr(row, column)) for column in COLUMNS] for row in table)
    return text.getvalue()


def as_json(plan: Plan, cell: ExpandedCell, table: Sequence[Row]) -> str:
    """One JSON document: `version`, `cell`, `fingerprint`, `modbus` and `canopen` (each may be null), `variables`.

    `variables` is a list of rows, `canopen` has the PDO table and the load of the bus by bit-rate.

    Keys are only ever added within a version.
    """
    modbus = modbus_of(plan)
    document = {
        "version": 1,
        "cell": plan.cell.name,
        "fingerprint": f"{plan.cell.fingerprint:08X}",
        "modbus": None if modbus is None else {"host": modbus.host, "port": modbus.port, "unit": modbus.unit},
        "canopen": as_document(cell),
        "variables": [dataclasses.asdict(row) for row in table],
    }
    return json_text(json.dumps(document, indent=2, ensure_ascii=False)) + "\n"


def as_markdown(plan: Plan, cell: ExpandedCell, table: Sequence[Row]) -> str:
    """A Markdown page with the columns that a PLC programmer needs; the PDO table after it."""
    lines = [f"# Registers of {plan.cell.name}", ""]
    modbus = modbus_of(plan)
    if modbus is not None:
        lines += [
            (
                f"Modbus TCP, port {modbus.port}, unit {modbus.unit}. Fingerprint of the mapping: "
                f"{plan.cell.fingerprint:08X}."
            ),
            "",
        ]
    head = (
        "no.", "name", "direction", "robot", "area", "address from 0", "4xxxxx", "type", "value", "limits",
        "owner", "when lost", "comment",
    )  # fmt: skip
    lines += ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines.extend("| " + " | ".join(map(_cell, _markdown(row))) + " |" for row in table)
    lines.extend(_markdown_pdos(cell))
    return "\n".join(lines) + "\n"


def _markdown_pdos(cell: ExpandedCell) -> Iterator[str]:
    """The PDO table, where there is a node."""
    node = node_of(cell)
    if node is None:
        return
    spec = node.part.spec
    yield from ("", f"## PDOs of node {spec.node} on {spec.channel} ({spec.bitrate} bit/s)", "")
    head = (
        "PDO",
        "COB-ID",
        "transmission",
        "inhibit",
        "event or deadline",
        "bit",
        "variable",
        "object",
        "type",
    )
    yield from ("| " + " | ".join(head) + " |", "|" + "---|" * len(head))
    for row in pdo_rows(cell):
        times = [seconds(time) if time is not None else "" for time in (row.inhibit, row.event)]
        for run in row.runs:
            texts = (
                row.pdo,
                row.cob_id,
                row.transmission,
                *times,
                str(run.bit),
                run.names,
                run.objects,
                run.type,
            )
            yield "| " + " | ".join(map(_cell, texts)) + " |"
    shares = ", ".join(f"{rate // 1000}k {share:.0%}" for rate, share in load_by_bit_rate(cell).items())
    yield from ("", f"Worst-case load of the bus by bit-rate: {shares}.")


def _markdown(row: Row) -> tuple[str, ...]:
    place = "" if row.address is None else str(row.address) + ("" if row.bit is None else f".{row.bit}")
    return (
        str(row.number),
        row.name,
        row.direction,
        row.robot,
        row.area,
        place,
        row.notation,
        f"{row.type} {row.order}".strip(),
        formula(row),
        limits(row),
        policy(row),
        lost(row),
        row.comment,
    )


def formula(row: Row) -> str:
    """How the raw number becomes the robot's value, with its unit: `raw * 0.1 N`; the unit alone for 1:1."""
    text = ""
    if row.scale not in (None, 1):
        text = f"raw * {row.scale:.10g}"
    if row.offset:
        text = f"{text or 'raw'} {'+' if row.offset > 0 else '-'} {abs(row.offset):.10g}"
    return f"{text} {row.unit}".strip()


def limits(row: Row) -> str:
    """`0..150`, and whether a value outside is clamped."""
    if row.low is None or row.high is None:
        return ""
    return f"{row.low:.10g}..{row.high:.10g}" + (" clamped" if row.clamp else "")


def policy(row: Row) -> str:
    """Who may own it and for how long: `plc > hmi, 5s`; with the group that it is owned with, `(motion, whole)`."""
    lease = "" if row.lease is None else f", {row.lease:.6g}s"
    group = f" ({row.group}{', whole' if row.whole else ''})" if row.group else ""
    return f"{row.owner}{lease}{group}"


def lost(row: Row) -> str:
    """What is seen when a side is lost: `clear`; `clear, running` where that is so without a running program too."""
    return (row.on_release or row.on_stale) + (f", {row.valid}" if row.valid else "")


def _plain(value: object) -> object:
    if value is None:
        return ""
    if isinstance(value, str):
        return printable(value)
    return str(value).lower() if isinstance(value, bool) else value


def _cell(text: str) -> str:
    return printable(" ".join(text.replace("|", "\\|").split()))
