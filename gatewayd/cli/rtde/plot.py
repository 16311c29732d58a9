"""`gatewayd rtde plot`: a picture of a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.output import refuse_existing, write_bytes
from gatewayd.cli.rtde.recordings import FAILED, delimiter_option, reading_progress, reported
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
  gatewayd rtde plot monday.csv friday.csv -f actual_TCP_force -o forces.png

\b
Exit codes:
  0  drawn
  1  the recording cannot be read to its end, or has nothing to draw
  2  wrong usage, OUT exists, or matplotlib is not installed
""",
)
@click.argument("files", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, readable=True))
@click.option(
    "-o",
    "--output",
    "out",
    metavar="OUT",
    type=click.Path(dir_okay=False),
    help="The picture: .png, .svg or .pdf; of one FILE otherwise its name with .png.",
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
@click.option("--title", metavar="TEXT", help="What stands above; otherwise the names of the files.")
@delimiter_option(
    "--delimiter", "What separates the columns of FILE, where it cannot be told from its first line."
)
@click.option("--force", is_flag=True, help="Overwrite OUT if it exists.")
@click.pass_context
def command(
    context: click.Context,
    files: tuple[str, ...],
    *,
    out: str | None,
    fields: tuple[str, ...],
    running: bool,
    title: str | None,
    delimiter: str | None,
    force: bool,
) -> None:
    """Draw the recordings FILES: each joint or element of a vector in a panel of its own, over the time in seconds.

    Actual and target values of one quantity share a panel, and so do several recordings, each from its own first
    package on. Curves are interrupted where packages are missing.
    """
    from gatewayd.cli.rtde.drawing import draw
    from gatewayd.cli.rtde.plotted import time_label

    target, form = _target(files, out, force=force)
    with reported(context):
        heads = [_head(file, delimiter) for file in files]
        panels = _panels([recipe for recipe, _host_time in heads], fields)
        drawn = {
            name: _read(file, delimiter, panels, running=running)
            for name, file in zip(_names(files), files, strict=True)
        }
        packages = sum(found.packages for found in drawn.values())
        if not packages:
            nothing = "no package while a program ran" if running else "no package"
            click.echo(printable(f"{', '.join(files)}: {nothing}: nothing was drawn"), err=True)
            context.exit(FAILED)
        above = title if title is not None else ", ".join(drawn)
        label = " or ".join(sorted({time_label(recipe, host_time=host_time) for recipe, host_time in heads}))
        picture = draw(form, panels, drawn, title=above, time_label=label)
    write_bytes(context, target, picture)
    click.echo(printable(f"{target}: {counted(len(panels), 'panel')}, {counted(packages, 'package')}"))


def _target(files: Sequence[str], out: str | None, *, force: bool) -> tuple[Path, str]:
    """Where the picture is to lie, and its form."""
    if out is None and len(files) > 1:
        raise click.UsageError("name the picture of several recordings with -o")
    target = Path(out) if out is not None else Path(files[0]).with_suffix(".png")
    form = _FORMS.get(target.suffix.lower())
    if form is None:
        raise click.UsageError(f"{target.name!r} is no picture that can be drawn: name it .png, .svg or .pdf")
    refuse_existing(target, overwrite=force)
    return target, form


def _names(files: Sequence[str]) -> Sequence[str]:
    """What the recordings are called: their names, or with their folders where names are there twice."""
    names = [Path(file).name for file in files]
    return names if len(set(names)) == len(names) else files


def _head(file: str, delimiter: str | None) -> tuple[Recipe, bool]:
    """The fields of a recording, and whether it has host time."""
    from gatewayd.rtde.recording import open_recording

    with open_recording(file, delimiter=delimiter) as recording:
        return recording.recipe, recording.host_time


def _panels(recipes: Sequence[Recipe], fields: Sequence[str]) -> tuple[Panel, ...]:
    from gatewayd.cli.rtde.panels import chosen, panels, together

    recipe = together(recipes)
    names, unknown = chosen(recipe, fields)
    there = listed(recipe.names, _SHOWN)
    if unknown:
        raise click.UsageError(f"the recording has no {', no '.join(unknown)}; it has {there}")
    found = panels(recipe, names)
    if len(found) > _MAX_PANELS:
        hint = f"choose some with --field: {there}"
        raise click.UsageError(f"{counted(len(found), 'panel')} are more than fit in a picture; {hint}")
    return found


def _read(file: str, delimiter: str | None, panels: Sequence[Panel], *, running: bool) -> Plotted:
    from gatewayd.cli.rtde.plotted import plotted
    from gatewayd.rtde.recording import open_recording, program_runs, read_gaps

    wanted = {curve.column for panel in panels for curve in panel.curves}
    gaps = {gap.package for gap in read_gaps(file)}
    with reading_progress() as progress, open_recording(file, delimiter=delimiter) as recording:
        runs = program_runs(recording.recipe) if running else None
        if running and runs is None:
            raise click.UsageError(f"--running needs runtime_state or robot_status_bits, which {file} lacks")
        found = plotted(_watched(recording, progress), recording.recipe, wanted, gaps=gaps, runs=runs)
    if recording.torn:
        click.echo(printable(recording.torn), err=True)
    return found


def _watched(recording: RecordingReader, progress: Callable[[RecordingReader, int], None]) -> Iterator[Row]:
    """The packages, while progress is shown."""
    for number, row in enumerate(recording.rows()):
        if number % _TOGETHER == 0:
            progress(recording, number)
        yield row
