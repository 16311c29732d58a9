"""`gatewayd rtde convert`: a finished recording in another format."""

from __future__ import annotations

from pathlib import Path

import click

from gatewayd.cli.rtde.progress import size_text
from gatewayd.cli.rtde.recordings import delimiter_option, reading_progress, reported, typed
from gatewayd.report.format import counted
from gatewayd.report.printable import printable

_WORDS = ("csv", "binary", "parquet")


@click.command(
    name="convert",
    epilog="""\b
Examples:
  gatewayd rtde convert robot_data.csv robot_data.parquet     for pandas, polars, DuckDB
  gatewayd rtde convert robot_data.bin robot_data.csv         for the official client's reader and plotter
  gatewayd rtde convert --delimiter semicolon robot_data.csv for-excel.csv
  gatewayd rtde convert --format binary robot_data.csv robot_data.rtde

\b
Exit codes:
  0  converted
  1  the recording cannot be read to its end, or the new one not be written; there is no new file then
  2  wrong usage, OUT exists, or the package for Parquet files is not installed
""",
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, readable=True))
@click.argument("out", type=click.Path(dir_okay=False))
@click.option(
    "--format",
    "form",
    type=click.Choice(_WORDS),
    help="The format of OUT; without it by its name: .csv, .txt, .bin, .parquet.",
)
@delimiter_option(
    "--delimiter", "What separates the columns of OUT: a character, or space, comma, semicolon, tab.", "space"
)
@delimiter_option(
    "--input-delimiter", "What separates those of FILE, where it cannot be told from its first line."
)
@click.option("--force", is_flag=True, help="Overwrite OUT if it exists.")
@click.pass_context
def command(
    context: click.Context,
    file: str,
    out: str,
    *,
    form: str | None,
    delimiter: str,
    input_delimiter: str | None,
    force: bool,
) -> None:
    """Write the finished recording FILE to OUT in another format: text (CSV), binary, or Parquet.

    FILE is a recording of `gatewayd rtde record` or of the official Python client, text or binary, or a Parquet file
    made from one; which it is shows its content. OUT appears when it is finished. The file of gaps beside FILE is
    copied too.
    """
    from gatewayd.rtde.recording import RecordingFormat, convert

    wanted = (
        next(member for member in RecordingFormat if member.word == form)
        if form is not None
        else RecordingFormat.of_name(out)
    )
    if wanted is None:
        raise click.UsageError(f"the name {out!r} stands for no format: choose one with --format")
    if wanted is not RecordingFormat.CSV and typed(context, "delimiter"):
        raise click.UsageError(f"--delimiter separates the columns of text, and {out} is to be {wanted.word}")
    with reading_progress() as progress, reported(context, remedy="overwrite it with --force"):
        done = convert(
            file, out, wanted, delimiters=(input_delimiter, delimiter), overwrite=force, progress=progress
        )
    if done.torn:
        click.echo(printable(done.torn), err=True)
    before, after = (size_text(Path(path).stat().st_size) for path in (file, out))
    click.echo(printable(f"{out}: {counted(done.packages, 'package')}, {after} ({file}: {before})"))
