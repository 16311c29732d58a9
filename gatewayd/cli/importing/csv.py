"""`gatewayd import csv`: a mapping proposed from a register list."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import reason_of
from gatewayd.cli.importing.defaults import (
    cell_name,
    cell_options,
    listen_address,
    output_options,
    strict_option,
)
from gatewayd.cli.output import refuse_existing, write_text
from gatewayd.report.format import counted
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gatewayd.cli.importing.findings import ImportFinding

FOUND, WRONG = 1, 2
"""Exit codes."""
_COUNTING = ("from-0", "from-1", "traditional")
_WRITER = re.compile(r"(?:(?P<name>[A-Za-z][A-Za-z0-9_]{0,63})=)?(?P<address>[0-9A-Fa-f.:/]+)")


@click.command(
    name="csv",
    epilog="""\b
Examples:
  gatewayd import csv registers.csv --host 192.0.2.10 --writer 192.0.2.20 -o press.yaml
  gatewayd import csv liste.csv --host 192.0.2.10 --addresses from-1         to standard output
  gatewayd show --format csv press.yaml > list.csv                           a list to begin with
  gatewayd import csv list.csv --host 192.0.2.10 --writer plc=192.0.2.20 --writer hmi=192.0.2.21

\b
Exit codes:
  0  proposed; doubts are listed on standard error
  1  the list has errors, each with line and column; nothing was written
  2  wrong usage, a file that cannot be read or written, or OUT exists
""",
)
@click.argument("file", type=click.Path(dir_okay=False, allow_dash=True))
@click.option("--host", required=True, metavar="HOST", help="Name or IP address of the robot's controller.")
@click.option(
    "--writer",
    "writers",
    multiple=True,
    metavar="[NAME=]ADDRESS",
    help="IP address of a PLC that may write; may be given several times. Without a name it is `plc`.",
)
@click.option(
    "--addresses",
    type=click.Choice(_COUNTING),
    help="How the list counts: from 0, from 1, or 40001 for the first holding register.",
)
@click.option(
    "--listen",
    metavar="ADDRESS:PORT",
    help="Where the PLC connects to; otherwise port 502, from other machines only if a writer is one.",
)
@cell_options
@output_options
@strict_option
@click.pass_context
def command(
    context: click.Context,
    file: str,
    *,
    host: str,
    writers: tuple[str, ...],
    addresses: str | None,
    listen: str | None,
    cell: str | None,
    series: str | None,
    version: str | None,
    out: str | None,
    strict: bool,
    force: bool,
) -> None:
    """Propose a mapping from the register list FILE (CSV).

    Columns are recognised by their names, English or German: name, address, type, access (R, W), area or function
    code, bit, length, byte order, scale, offset, unit, limits, comment, robot. Comma, semicolon, tab and bar separate
    them, and decimals may have a comma. Addresses may be 100, 0x64, 100.3, 400101, %MW100, %MX100.3, %MD50, %QW100 or
    %IW100; both limits may stand in one cell, 0..100.

    A list that names no field of the robot gets the next free registers of the robot program. Everything that was
    understood in one of several ways is listed with its line and column. With an error nothing is written. The result
    passes `gatewayd check`. What `gatewayd show --format csv` writes for a mapping without CANopen comes back the
    same.
    """
    from gatewayd.cli.importing.register_list.mapping import ListSettings
    from gatewayd.cli.importing.register_list.proposal import proposal

    if out is not None:
        refuse_existing(out, overwrite=force)
    name = "stdin" if file == "-" else Path(file).name
    known = dict(map(_writer, writers))
    settings = ListSettings(
        cell=cell if cell is not None else cell_name(name),
        host=host,
        listen=listen if listen is not None else listen_address(known.values()),
        writers=known,
        series=series,
        version=version,
    )
    found = proposal(_content(context, file), settings, addresses or "", name)
    _print_findings(file, found.findings)
    doubts = sum(not finding.is_error for finding in found.findings)
    if found.text is None or (strict and doubts):
        why = "" if found.text is None else ": doubts count as errors with --strict"
        click.echo(f"nothing was written{why}", err=True)
        context.exit(FOUND)
    if out is None:
        click.echo(found.text, nl=False)
    else:
        write_text(context, out, found.text)
        remark = f", {counted(doubts, 'doubt')}" if doubts else ""
        click.echo(printable(f"{out}: {counted(found.variables, 'variable')}{remark}"))


def _writer(text: str) -> tuple[str, str]:
    match = _WRITER.fullmatch(text)
    if match is None:
        raise click.UsageError(f"--writer {text}: write an IP address or a network, or NAME=ADDRESS")
    return match["name"] or "plc", match["address"]


def _content(context: click.Context, file: str) -> bytes:
    from gatewayd.cli.importing.register_list.table import MAX_BYTES

    try:
        with click.open_file(file, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        click.echo(printable(f"{click.format_filename(file)}: cannot be read: {reason_of(error)}"), err=True)
        context.exit(WRONG)
    assert isinstance(content, bytes)
    return content


def _print_findings(file: str, findings: Sequence[ImportFinding]) -> None:
    for finding in findings:
        for line in finding.lines(str(click.format_filename(file))):
            click.echo(printable(line), err=True)
