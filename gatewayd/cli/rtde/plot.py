"""`gatewayd rtde plot`: a picture of a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import reason_of
from gatewayd.cli.rtde.recordings import FAILED, WRONG, Progress, delimiter_option, reported
from gatewayd.report.format import counted, listed
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.cli.rtde.panels import Panel
    from gatewayd.cli.rtde.plotted import Plotted, Row
    from gatewayd.rtde.recipe import Recipe
    from gatewayd.rtde.recording import RecordingReader

_FORMS = {".png": "png", ".svg": "svg", ".pdf": "pdf"}
_MAX_PANELS = 36
_SHOWN = 12
_TOGETHER = 256


@click.command(
    name="plot",
    epilog="""\b
Examples:
  gatewayd rtde plot robot_data.csv                         everything in it, into robot_data.png
  gatewayd rtde plot robot_data.csv -f actual_q -f target_q     both in one panel for each joint
  gatewayd rtde plot robot_data.csv -f 'actual_q[1]' -f actual_TCP_force
  gatewayd rtde plot robot_data.csv -f '*_current' --running -o current.svg

\b
Exit codes:
  0  drawn
  1  the recording cannot be read to its end, or has nothing to draw
  2  wrong usage, OUT exists, or matplotlib is not installed
""",
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, readable=True))
@click.option(
    "-o",
    "--output",
    "out",
    metavar="OUT",
    type=click.Path(dir_okay=False),
    help="The picture: .png, .svg or .pdf; otherwise FILE with .png.",
)
@click.option(
    "-f",
    "--field",
    "fields",
    multiple=True,
    metavar="NAME",
    help="A field, an element as in actual_q[1], or a pattern; may be given several times.",
)
@click.option(
    "--running", is_flag=True, help="Only while the program runs, by runtime_state or robot_status_bits."
)
@click.option("--title", metavar="TEXT", help="What stands above; otherwise the name of FILE.")
@delimiter_option(
    "--delimiter", "What separates the columns of FILE, where it cannot be told from its first line."
)
@click.option("--force", is_flag=True, help="Overwrite OUT if it exists.")
@click.pass_context
def command(
    context: click.Context,
    file: str,
    *,
    out: str | None,
    fields: tuple[str, ...],
    running: bool,
    title: str | None,
    delimiter: str | None,
    force: bool,
) -> None:
    """Draw the recording FILE: each joint or element of a vector in a panel of its own, over the time in seconds.

    Actual and target values of one quantity share a panel. Curves are interrupted where packages are missing.
    """
    from gatewayd.cli.rtde.drawing import draw
    from gatewayd.cli.rtde.plotted import time_label
    from gatewayd.rtde.recording import open_recording

    target = Path(out) if out is not None else Path(file).with_suffix(".png")
    form = _FORMS.get(target.suffix.lower())
    if form is None:
        raise click.UsageError(f"{target.name!r} is no picture that can be drawn: name it .png, .svg or .pdf")
    if target.exists() and not force:
        raise click.UsageError(f"{click.format_filename(target)} exists; overwrite it with --force")
    with Progress() as progress, reported(context), open_recording(file, delimiter=delimiter) as recording:
        panels = _panels(recording.recipe, fields)
        drawn = _read(recording, file, panels, progress, running=running)
        label = time_label(recording.recipe, host_time=recording.host_time)
        torn = recording.torn
    if torn:
        click.echo(printable(torn), err=True)
    if not drawn.packages:
        nothing = "no package while a program ran" if running else "no package"
        click.echo(printable(f"{file}: has {nothing}: nothing was drawn"), err=True)
        context.exit(FAILED)
    above = title if title is not None else Path(file).name
    with reported(context):
        picture = draw(form, panels, drawn, title=above, time_label=label)
    _save(context, target, picture)
    click.echo(printable(f"{target}: {counted(len(panels), 'panel')}, {counted(drawn.packages, 'package')}"))


def _panels(recipe: Recipe, fields: Sequence[str]) -> tuple[Panel, ...]:
    from gatewayd.cli.rtde.panels import chosen, panels

    names, unknown = chosen(recipe, fields)
    there = listed(recipe.names, _SHOWN)
    if unknown:
        raise click.UsageError(f"the recording has no {', no '.join(unknown)}; it has {there}")
    found = panels(recipe, names)
    if len(found) > _MAX_PANELS:
        hint = f"choose some with --field: {there}"
        raise click.UsageError(f"{counted(len(found), 'panel')} are more than fit in a picture; {hint}")
    return found


def _read(
    recording: RecordingReader, file: str, panels: Sequence[Panel], progress: Progress, *, running: bool
) -> Plotted:
    from gatewayd.cli.rtde.plotted import plotted
    from gatewayd.rtde.recording import program_runs, read_gaps

    runs = program_runs(recording.recipe) if running else None
    if running and runs is None:
        raise click.UsageError("--running needs runtime_state or robot_status_bits in the recording")
    drawn = {curve.column for panel in panels for curve in panel.curves}
    gaps = {gap.package for gap in read_gaps(file)}
    return plotted(_watched(recording, progress), recording.recipe, sorted(drawn), gaps=gaps, runs=runs)


def _watched(recording: RecordingReader, progress: Progress) -> Iterator[Row]:
    """The packages, while progress is shown."""
    for number, row in enumerate(recording.rows()):
        if number % _TOGETHER == 0:
            progress(recording, number)
        yield row


def _save(context: click.Context, target: Path, picture: bytes) -> None:
    try:
        target.write_bytes(picture)
    except OSError as error:
        click.echo(printable(f"{target}: cannot be written: {reason_of(error)}"), err=True)
        context.exit(WRONG)
