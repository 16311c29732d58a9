"""`gatewayd show`: the register table of a mapping file, for the screen, a PLC project or a document."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import click

from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.modbus_server.plan import ModbusPlan, modbus_of
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from rich.table import Table

    from gatewayd.mapping.loader import Loaded
    from gatewayd.mapping.plan import Plan
    from gatewayd.report.table import Row

__all__ = ["command"]

BROKEN, UNREADABLE = 1, 2
"""Exit codes."""
PIPE_WIDTH = 120
"""Columns of the table where neither a terminal nor COLUMNS says how wide it is."""

_WIDE = 100
_NAME_WIDTH = 20


@click.command(
    name="show",
    epilog="""\b
Examples:
  gatewayd show my-cell.yaml                        a look at the screen
  gatewayd show --all my-cell.yaml                  every element of ranges and vectors
  gatewayd show --format csv my-cell.yaml > map.csv for a spreadsheet or the PLC's tag import
  gatewayd show --format markdown my-cell.yaml      for the documents of the cell

\b
Exit codes:
  0  shown
  1  the file has errors (they are listed)
  2  wrong usage, or the file cannot be read
""",
)
@click.argument("file", type=click.Path(allow_dash=True))
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "json", "markdown"]),
    default="table",
    show_default=True,
    help="The table for the screen, or all rows for programs and documents.",
)
@click.option(
    "--all", "every", is_flag=True, help="One row for every variable, not for every line of the file."
)
@click.pass_context
def command(context: click.Context, file: str, form: str, *, every: bool) -> None:
    """Print what lies where in the mapping FILE: addresses from 0 and in 4xxxxx form, types, scales, limits, who may
    write for how long, and what is seen when a side is lost. `-` reads standard input.
    """
    loaded = _load(context, file)
    plan = loaded.plan
    if plan is None:
        _complain(loaded)
        context.exit(BROKEN)
    if form == "table":
        _print_table(loaded, plan, every=every)
        return
    from gatewayd.report.table import as_csv, as_json, as_markdown, rows

    table = rows(loaded.cell)
    written = {
        "csv": lambda: as_csv(table),
        "json": lambda: as_json(plan, loaded.cell, table),
        "markdown": lambda: as_markdown(plan, loaded.cell, table),
    }
    click.echo(written[form](), nl=False)


def _load(context: click.Context, file: str) -> Loaded:
    import sys
    from pathlib import Path

    from gatewayd.mapping.loader import load, read_bytes
    from gatewayd.mapping.source import MAXIMUM_BYTES

    if file == "-":
        return load(sys.stdin.buffer.read(MAXIMUM_BYTES + 1), "stdin")
    name = str(click.format_filename(file))
    try:
        return load(read_bytes(Path(file)), name)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        click.echo(printable(f"{name}: cannot be read: {reason}"), err=True)
        context.exit(UNREADABLE)


def _complain(loaded: Loaded) -> None:
    from gatewayd.report.findings import Outcome, as_text

    click.echo(as_text(Outcome((loaded.name,), loaded.diagnostics)), nl=False, err=True)


def _print_table(loaded: Loaded, plan: Plan, *, every: bool) -> None:
    import os
    import sys

    from rich.console import Console

    from gatewayd.report.table import by_line, rows

    entries = [(row, row) for row in rows(loaded.cell)] if every else list(by_line(loaded.cell))
    known = sys.stdout.isatty() or "COLUMNS" in os.environ
    console = Console(width=None if known else PIPE_WIDTH, markup=False, highlight=False)
    console.print(printable(_heading(plan)), style="bold")
    console.print(_table(entries, wide=console.width >= _WIDE))
    if canopen_of(plan) is not None:
        console.print(_pdo_table(loaded))
        for line in _loads(loaded):
            console.print(line, soft_wrap=True)
    for line in _notes(loaded, plan, shortened=any(first is not last for first, last in entries)):
        console.print(printable(line), style="dim", soft_wrap=True)


def _heading(plan: Plan) -> str:
    count = len(plan.cell.variables)
    parts = [f"{plan.cell.name}: {count} variable" + ("" if count == 1 else "s")]
    if modbus_of(plan) is not None:
        host = (
            f"[{plan.the(ModbusPlan).host}]"
            if ":" in plan.the(ModbusPlan).host
            else plan.the(ModbusPlan).host
        )
        parts.append(f"Modbus TCP {host}:{plan.the(ModbusPlan).port} unit {plan.the(ModbusPlan).unit}")
    if canopen_of(plan) is not None:
        parts.append(f"CANopen {plan.the(CanopenPlan).channel} node {plan.the(CanopenPlan).node}")
    parts.append(f"fingerprint {plan.cell.fingerprint:08X}")
    return ", ".join(parts)


def _notes(loaded: Loaded, plan: Plan, *, shortened: bool) -> list[str]:
    from gatewayd.links.registry import languages

    notes = []
    for part, writer in zip(loaded.cell.document.writers.values(), plan.cell.writers, strict=True):
        known = [name for language in languages() for name in language.names(part.spec)]
        silences = [writer.timeout, *(language.silence(part.spec) for language in languages())]
        silence = next((silence for silence in silences if silence is not None), None)
        watch = "no timeout" if silence is None else f"lost after {silence:.6g}s of silence"
        watch += " (only writes count)" if writer.counts_writes else ""
        watch += f", keeps what it owns for {writer.grace:.6g}s without a connection" if writer.grace else ""
        notes.append(f"writer {writer.name}: {', '.join(known)}, {watch}")
    notes.append("-> towards the robot, <- from the robot; addresses from 0; bit 0 is the least significant")
    if plan.cell.locks and plan.cell.adopt_for is not None and not plan.cell.clear_on_connect:
        notes.append(
            f"what the controller holds at the start falls back after {plan.cell.adopt_for:.6g}s without an owner"
        )
    if any(variable.valid_running for variable in plan.cell.variables):
        notes.append("running: not good while the robot program does not run")
    if modbus_of(plan) is not None:
        notes.append("status of the gateway: holding and input registers from 60000 (460001, 360001)")
    if canopen_of(plan) is not None:
        notes.append("status of the gateway: objects from 5F00h")
    if shortened:
        notes.append("ranges on one line of the file are one row here; --all shows each variable")
    return notes


def _table(entries: list[tuple[Row, Row]], *, wide: bool) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from gatewayd.report.table import formula, limits, lost, policy

    table = Table(box=box.SIMPLE_HEAD, padding=0, pad_edge=False)
    for title, whole in _COLUMNS.items():
        justify: Literal["left", "right"] = "right" if title == "no." else "left"
        least = min(_NAME_WIDTH, max((len(last.name) for _, last in entries), default=0))
        table.add_column(
            title,
            justify=justify,
            no_wrap=whole and wide,
            overflow="fold",
            min_width=least if title == "name" and wide else None,
        )
    previous = entries[0][0].direction if entries else ""
    for first, last in entries:
        if first.direction != previous:
            table.add_section()
            previous = first.direction
        towards = first.direction == "input"
        type_name = first.type if first.order in ("", "ABCD") else f"{first.type} {first.order}"
        place = f"{first.area} {_addresses(first, last)}".strip()
        if not place and first.object:
            place, type_name = f"object {_objects(first.object, last.object)}", first.can_type
        texts = (
            Text(str(first.number), "dim"),
            Text(_range(first.name, last.name), "bold"),
            Text(
                f"{'->' if towards else '<-'} {_range(first.robot, last.robot)}",
                "cyan" if towards else "green",
            ),
            Text(place),
            Text(_notations(first, last)),
            Text(type_name),
            Text(printable(", ".join(filter(None, (formula(first), limits(first)))))),
            Text(policy(first)),
            Text(lost(first)),
        )
        table.add_row(*texts)
    return table


def _pdo_table(loaded: Loaded) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from gatewayd.core.definition import Direction
    from gatewayd.links.canopen_node.pdo_table import pdo_rows
    from gatewayd.report.wording import seconds

    table = Table(box=box.SIMPLE_HEAD, padding=0, pad_edge=False)
    for title in _PDO_COLUMNS:
        table.add_column(title, overflow="fold")
    for row in pdo_rows(loaded.cell):
        receives = row.direction is Direction.INPUT
        for number, run in enumerate(row.runs):
            own = (
                Text(row.pdo, "bold"),
                Text(row.cob_id),
                Text(row.transmission),
                Text("" if row.inhibit is None else seconds(row.inhibit)),
                Text("" if row.event is None else seconds(row.event)),
            )
            table.add_row(
                *(own if number == 0 else [Text()] * len(own)),
                Text(_span(str(run.bit), str(run.bit + run.bits - 1))),
                Text(f"{'->' if receives else '<-'} {run.names}", "cyan" if receives else "green"),
                Text(run.objects),
                Text(run.type),
            )
    return table


_PDO_COLUMNS = ("PDO", "COB-ID", "transmission", "inhibit", "event", "bits", "variables", "object", "type")


def _loads(loaded: Loaded) -> Iterator[str]:
    """What no PDO carries, and the share of the bus in the worst case for each bit-rate."""
    from gatewayd.links.canopen_node.pdo_table import by_sdo_only, load_by_bit_rate

    objects = by_sdo_only(loaded.cell)
    if objects:
        yield f"by SDO only: {', '.join(objects)}"
    shares = [f"{rate // 1000}k {share:.0%}" for rate, share in load_by_bit_rate(loaded.cell).items()]
    yield f"worst-case bus load by bit-rate: {', '.join(reversed(shares))}"


def _objects(first: str, last: str) -> str:
    """`2000h:01-40`; both in full where the index changes."""
    if first.partition(":")[0] == last.partition(":")[0] and first != last:
        return f"{first}-{last.partition(':')[2]}"
    return _span(first, last)


_COLUMNS = {
    "no.": True,
    "name": False,
    "robot": True,
    "address": True,
    "4xxxxx": True,
    "type": True,
    "value": False,
    "owner": False,
    "lost": True,
}
"""Titles, and whether the column is kept in one piece where the screen is wide enough."""


def _range(first: str, last: str) -> str:
    """`recipe[0..23]` for `recipe[0]` and `recipe[23]`: what both begin and end with is said once."""
    if first == last:
        return first
    head = first.rstrip("0123456789]")
    tail = "]" if first.endswith("]") else ""
    return f"{first.removesuffix(tail)}..{last[len(head) :]}" if last.startswith(head) else f"{first}..{last}"


def _addresses(first: Row, last: Row) -> str:
    """Protocol addresses covered: `100-147`, `0.0-3.15`."""
    if first.address is None or last.address is None:
        return ""
    if first.bit is not None:
        return _span(f"{first.address}.{first.bit}", f"{last.address}.{last.bit}")
    return _span(str(first.address), str(last.address + last.words - 1))


def _notations(first: Row, last: Row) -> str:
    """The same in 4xxxxx form; of bits in several registers the registers."""
    if not first.notation or (first.notation == last.notation and first.bit is not None):
        return first.notation
    begin, end = (row.notation.partition(".")[0] for row in (first, last))
    return _span(begin, f"{int(end) + last.words - 1:06d}")


def _span(first: str, last: str) -> str:
    return first if first == last else f"{first}-{last}"
