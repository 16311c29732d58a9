"""`gatewayd show`: the register table of a mapping file, for the screen, a PLC project or a document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import click

from gatewayd.cli.files import format_option, load_plan
from gatewayd.cli.printing import echo, on_screen
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from rich.table import Table

    from gatewayd.mapping.loader import Loaded
    from gatewayd.mapping.plan import Plan
    from gatewayd.report.layout import ReportTable, Row

PIPE_WIDTH = 120
"""Columns of the table where neither a terminal nor COLUMNS says how wide it is."""

_EDGES = 2
"""Blanks beside a table."""
_EXPENDABLE = ("no.", "lost", "owner", "robot", "value", "type", "address")
"""Columns that a narrow screen can do without, the first ones first."""


@click.command(
    name="show",
    epilog="""\b
Examples:
  gatewayd show my-cell.yaml                         a table for the screen
  gatewayd show --all my-cell.yaml                   every element of ranges and vectors
  gatewayd show --format csv my-cell.yaml > map.csv  for a spreadsheet or the PLC's tag import
  gatewayd show --format markdown my-cell.yaml       for the documents of the cell

\b
Exit codes:
  0  shown
  1  the file has errors (they are listed)
  2  wrong usage, or the file cannot be read
""",
)
@click.argument("file", type=click.Path(allow_dash=True))
@format_option(
    "table",
    "csv",
    "json",
    "markdown",
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
    loaded, plan = load_plan(context, file)
    if form == "table":
        _print_table(loaded, plan, every=every)
        return
    from gatewayd.report.table import as_csv, as_json, as_markdown, rows

    table = rows(loaded.cell)
    if form == "csv":
        click.echo(as_csv(table), nl=False)
    else:
        write = as_json if form == "json" else as_markdown
        click.echo(write(plan, loaded.cell, table), nl=False)


def _print_table(loaded: Loaded, plan: Plan, *, every: bool) -> None:
    from rich.console import Console

    from gatewayd.links.registry import tables
    from gatewayd.report.table import by_line, rows

    entries = [(row, row) for row in rows(loaded.cell)] if every else list(by_line(loaded.cell))
    console = Console(width=None if on_screen() else PIPE_WIDTH, markup=False, highlight=False)
    echo(click.style(printable(_heading(plan)), bold=True), broken=on_screen())
    table, dropped = _table(entries, console.width)
    console.print(table)
    for link in tables():
        further = link.screen_table(loaded.cell) if link.key in plan.kinds else None
        if further is not None:
            console.print(_further_table(further, console.width))
            for line in further.notes:
                echo(line, broken=on_screen())
    if dropped:
        echo(
            f"left out, as the screen is narrow: {', '.join(dropped)}; --format csv has all columns",
            broken=on_screen(),
        )
    for line in _notes(loaded, plan, shortened=any(first is not last for first, last in entries)):
        echo(click.style(printable(line), dim=True), broken=on_screen())


def _heading(plan: Plan) -> str:
    from gatewayd.links.registry import tables
    from gatewayd.report.format import counted

    parts = [f"{plan.cell.name}: {counted(len(plan.cell.variables), 'variable')}"]
    here = (link.headline(plan) for link in tables() if link.key in plan.kinds)
    parts += [headline for headline in here if headline]
    parts.append(f"fingerprint {plan.cell.fingerprint:08X}")
    return ", ".join(parts)


def _notes(loaded: Loaded, plan: Plan, *, shortened: bool) -> list[str]:
    from gatewayd.links.registry import languages, tables

    notes = []
    for part, writer in zip(loaded.cell.document.writers.values(), plan.cell.writers, strict=True):
        known = [name for language in languages() for name in language.names(part.spec)]
        silences = [writer.timeout, *(language.silence(part.spec) for language in languages())]
        silence = next((silence for silence in silences if silence is not None), None)
        ends = [language.lost_by for language in languages() if language.supervises(part.spec)]
        watch = next(filter(None, ends), "no timeout")
        watch = watch if silence is None else f"lost after {silence:.6g}s of silence"
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
    here = [link for link in tables() if link.key in plan.links]
    notes.extend(note for link in here for note in link.notes)
    notes.extend(text for link in here for text in link.legend(loaded.cell))
    if shortened:
        notes.append("ranges on one line of the file are one row here; --all shows each variable")
    return notes


def _table(entries: Sequence[tuple[Row, Row]], width: int) -> tuple[Table, tuple[str, ...]]:
    """The table in so many columns of the screen, and the names of its own columns that have no room there."""
    from rich.text import Text

    from gatewayd.links.registry import tables
    from gatewayd.report.fitting import fitted, folded
    from gatewayd.report.layout import Column, arranged

    own = [Column(name) for name in ("no.", "name", "value", "owner", "lost")]
    further = (
        column for link in tables() for column in (link.columns if link.screen is None else link.screen)
    )
    columns = arranged(own, further)
    rows = [_texts(first, last) for first, last in entries]
    texts = {column.name: [column.name, *(row.get(column.name, "") for row in rows)] for column in columns}
    fit = fitted(texts, width - _EDGES, _EXPENDABLE)
    columns = tuple(column for column in columns if column.name in fit.widths)
    table = _empty_table()
    for column in columns:
        justify: Literal["left", "right"] = "right" if column.name == "no." else "left"
        table.add_column(column.name, justify=justify, no_wrap=True, width=fit.widths[column.name])
    previous = entries[0][0].direction if entries else ""
    for (first, _), row in zip(entries, rows, strict=True):
        if first.direction != previous:
            table.add_section()
            previous = first.direction
        colour = "cyan" if first.direction == "input" else "green"
        table.add_row(
            *(
                Text(
                    folded(row.get(column.name, ""), fit.widths[column.name]),
                    colour if column.coloured else _STYLES.get(column.name, ""),
                )
                for column in columns
            )
        )
    return table, fit.dropped


_STYLES = {"no.": "dim", "name": "bold"}


def _texts(first: Row, last: Row) -> dict[str, str]:
    """What stands in the columns; of several links with a text for one the first has it."""
    from gatewayd.links.registry import tables
    from gatewayd.report.table import formula, limits, lost, policy
    from gatewayd.report.wording import family

    texts = {
        "no.": str(first.number),
        "name": family(first.name, last.name),
        "value": printable(", ".join(filter(None, (formula(first), limits(first))))),
        "owner": policy(first),
        "lost": lost(first),
    }
    for link in tables():
        for name, text in link.on_screen(first, last).items():
            texts[name] = texts.get(name) or text
    return texts


def _empty_table() -> Table:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, padding=0, pad_edge=False)


def _further_table(content: ReportTable, width: int) -> Table:
    from rich.text import Text

    from gatewayd.report.fitting import fitted, folded

    table = _empty_table()
    # Beside the number of a column, since several may have one head.
    plain = [[cell if isinstance(cell, str) else cell[0] for cell in row] for row in content.rows]
    texts = {str(at): [title, *(row[at] for row in plain)] for at, title in enumerate(content.head)}
    widths = list(fitted(texts, width - _EDGES, ()).widths.values())
    for title, wide in zip(content.head, widths, strict=True):
        table.add_column(folded(title, wide), width=wide, overflow="fold")
    for row in content.rows:
        cells = zip(row, widths, strict=True)
        table.add_row(
            *(
                Text(folded(cell, wide)) if isinstance(cell, str) else Text(folded(cell[0], wide), cell[1])
                for cell, wide in cells
            )
        )
    return table
