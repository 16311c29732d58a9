"""`gatewayd import eds`: a mapping proposed from the data sheet of a CANopen device."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import reason_of
from gatewayd.cli.importing.defaults import cell_name, output_options, strict_option
from gatewayd.cli.output import refuse_existing, write_text
from gatewayd.report.format import counted
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.links.proposals import SheetProposal, SheetReader

FOUND, WRONG = 1, 2
"""Exit codes."""
_MAX_SHEET = 4 << 20
"""Bytes of a data sheet."""
_MAX_NAME = 24
_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


@click.command(
    name="eds",
    epilog="""\b
Examples:
  gatewayd import eds encoder.eds --host 192.0.2.10 --node 5                 to standard output
  gatewayd import eds island.eds --host 192.0.2.10 --node 7 --bus can1 -o press.yaml
  gatewayd import eds drive.dcf --host 192.0.2.10 --node 3 --device drive --leave-out -o press.yaml

\b
Exit codes:
  0  proposed; doubts are listed on standard error
  1  something cannot be carried over, each object listed with its line; nothing was written, or the rest of it
     with --leave-out
  2  wrong usage, a file that cannot be read or written, or OUT exists
""",
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, readable=True))
@click.option("--host", required=True, metavar="HOST", help="Name or IP address of the robot's controller.")
@click.option("--node", required=True, type=click.IntRange(1, 127), help="Node-ID that the device is set to.")
@click.option(
    "--bus", default="can0", show_default=True, metavar="NAME", help="CAN bus that the device is on."
)
@click.option(
    "--device", metavar="NAME", help="What the mapping calls it; otherwise made of the file's name."
)
@click.option("--cell", metavar="NAME", help="Name of the cell; otherwise made of the file's name.")
@click.option("--leave-out", is_flag=True, help="Write the rest where something cannot be carried over.")
@output_options
@strict_option
@click.pass_context
def command(
    context: click.Context,
    file: str,
    *,
    host: str,
    node: int,
    bus: str,
    device: str | None,
    cell: str | None,
    out: str | None,
    leave_out: bool,
    strict: bool,
    force: bool,
) -> None:
    """Propose a mapping from FILE, the data sheet (EDS or DCF) of a CANopen device that the gateway manages.

    What the device's PDOs carry as delivered becomes variables: from the device inputs of the robot, to it outputs, in
    the next free registers of the robot program. Other objects that PDOs can carry follow as a comment, with
    direction and type. Whatever the data sheet leaves open is listed with its line. The result passes `gatewayd check`,
    and is made to be edited.
    """
    from gatewayd.links.proposals import RemarkKind, SheetSettings

    if out is not None:
        refuse_existing(out, overwrite=force)
    name = device if device is not None else _device_name(file)
    if not _NAME.fullmatch(name):
        raise click.UsageError(f"--device {printable(name)}: write lower-case letters, digits and _")
    settings = SheetSettings(
        cell=cell if cell is not None else cell_name(file),
        host=host,
        device=name,
        bus=bus,
        node=node,
        path=os.path.relpath(file, Path(out).parent if out is not None else "."),
    )
    found = _reader().propose(_content(context, file), settings)
    _print_remarks(file, found)
    left = sum(remark.kind is RemarkKind.ERROR for remark in found.remarks)
    doubts = sum(remark.kind is RemarkKind.DOUBT for remark in found.remarks)
    if not found.text or (left and not leave_out) or (strict and doubts):
        more = "; --leave-out writes the rest" if found.text and left and not leave_out else ""
        click.echo(f"nothing was written{more}", err=True)
        context.exit(FOUND)
    _write(context, found, out, doubts)
    if left:
        context.exit(FOUND)


def _device_name(file: str) -> str:
    """`encoder_mx` for `Encoder-MX.eds`; a name that stands for something else in the status gets a number."""
    from gatewayd.links.registry import kinds
    from gatewayd.report.schema import taken_names

    found = re.sub(r"[^a-z0-9]+", "_", Path(file).stem.lower()).strip("_")[:_MAX_NAME].rstrip("_")
    name = found if found[:1].isalpha() else "slave"
    taken = {*taken_names(has_places=True), *(kind.key for kind in kinds()), "cell"}
    return f"{name}_1" if name in taken else name


def _reader() -> SheetReader:
    from gatewayd.links.registry import sheet_readers

    (reader,) = sheet_readers()
    return reader


def _content(context: click.Context, file: str) -> bytes:
    try:
        with Path(file).open("rb") as stream:
            content = stream.read(_MAX_SHEET + 1)
    except OSError as error:
        click.echo(printable(f"{click.format_filename(file)}: cannot be read: {reason_of(error)}"), err=True)
        context.exit(WRONG)
    if len(content) > _MAX_SHEET:
        click.echo(
            printable(f"{click.format_filename(file)}: is longer than {_MAX_SHEET >> 20} MiB"), err=True
        )
        context.exit(WRONG)
    return content


def _print_remarks(file: str, found: SheetProposal) -> None:
    from gatewayd.cli.importing.findings import FindingKind, ImportFinding

    for remark in found.remarks:
        kind = FindingKind(remark.kind.value)
        finding = ImportFinding(remark.line, 0, remark.text, kind, remark.hint)
        for line in finding.lines(str(click.format_filename(file))):
            click.echo(printable(line), err=True)


def _write(context: click.Context, found: SheetProposal, out: str | None, doubts: int) -> None:
    """Write what passes the check; its findings are printed, and errors among them leave nothing written."""
    from gatewayd.mapping.loader import load
    from gatewayd.report.findings import CheckOutcome, as_text

    name = out if out is not None else "stdout"
    loaded = load(found.text.encode(), name)
    if loaded.plan is None:
        click.echo(as_text(CheckOutcome((name,), loaded.diagnostics)), nl=False, err=True)
        click.echo("nothing was written: a mapping with these errors cannot start", err=True)
        context.exit(FOUND)
    if out is None:
        click.echo(found.text, nl=False)
        return
    write_text(context, out, found.text)
    remark = f", {counted(doubts, 'doubt')}" if doubts else ""
    click.echo(printable(f"{out}: {counted(found.variables, 'variable')}{remark}"))
