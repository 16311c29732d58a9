"""`gatewayd export`: what other tools need of a cell, made from its mapping file."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import click

from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.robot.plan import robot_of
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.canopen.dictionary import Dictionary
    from gatewayd.links.canopen_node.plan import CanopenPlan
    from gatewayd.mapping.plan import Plan

__all__ = ["command"]

BROKEN, UNREADABLE = 1, 2
"""Exit codes."""
STDIN = STDOUT = "-"
"""The file name that stands for standard input and output."""

_EXIT_CODES = """\
\b
Exit codes:
  0  written
  1  the file has errors (they are listed), or nothing of what is asked for
  2  wrong usage, or a file that cannot be read or written
"""

_file = click.argument("file", type=click.Path(allow_dash=True))
_output = click.option(
    "-o",
    "--output",
    metavar="OUT",
    type=click.Path(allow_dash=True),
    default=STDOUT,
    help="Where to write it; standard output otherwise.",
)


@click.group(
    name="export",
    epilog="""\b
Examples:
  gatewayd export eds my-cell.yaml -o my-cell.eds      for the CANopen master's configurator
  gatewayd export dcf my-cell.yaml -o my-cell.dcf      the same with node-ID, bit-rate and values
  gatewayd export urscript my-cell.yaml                the watchdog line of the robot program
  gatewayd show --format csv my-cell.yaml              the register list, for a spreadsheet
""",
)
def command() -> None:
    """Write files for other tools from a mapping FILE: the CANopen data sheet, robot program lines."""


@command.command(
    name="eds",
    short_help="The electronic data sheet, for the master's configurator.",
    epilog=f"""\b
Examples:
  gatewayd export eds my-cell.yaml -o my-cell.eds
\n{_EXIT_CODES}""",
)
@_file
@_output
@click.pass_context
def eds(context: click.Context, file: str, output: str) -> None:
    """Write the electronic data sheet (CiA 306) of the node of a mapping FILE, for the configurator of the master.

    Before it is written, python-canopen's importer has read it back, every entry as it was meant. The same mapping
    gives the same bytes. The sheet is valid for any node-ID; COB-IDs beyond the four predefined of each direction are
    those of the mapping.
    """
    from gatewayd.links.canopen_node.eds import eds_text, objects_of, sheet_of

    plan, canopen = _node(context, file)
    dictionary = objects_of(canopen, plan.cell)
    text = eds_text(dictionary, sheet_of(canopen, plan.cell, "eds"))
    _read_back(context, text, dictionary, canopen)
    _write(context, output, text)


@command.command(
    name="dcf",
    short_help="The same with node-ID, bit-rate and values.",
    epilog=f"""\b
Examples:
  gatewayd export dcf my-cell.yaml -o my-cell.dcf
\n{_EXIT_CODES}""",
)
@_file
@_output
@click.pass_context
def dcf(context: click.Context, file: str, output: str) -> None:
    """Write the device configuration file (CiA 306) of a mapping FILE: its data sheet with the node-ID, the bit-rate
    and the value of every parameter as the mapping has them.
    """
    from gatewayd.links.canopen_node.eds import Commissioning, dcf_text, objects_of, sheet_of

    plan, canopen = _node(context, file)
    commissioning = Commissioning(canopen.node, canopen.bitrate, plan.cell.name)
    dictionary = objects_of(canopen, plan.cell)
    text = dcf_text(dictionary, sheet_of(canopen, plan.cell, "dcf"), commissioning)
    _read_back(context, text, dictionary, canopen)
    _write(context, output, text)


@command.command(
    name="urscript",
    short_help="The watchdog line of the robot program.",
    epilog=f"""\b
Examples:
  gatewayd export urscript my-cell.yaml
\n{_EXIT_CODES}""",
)
@_file
@_output
@click.pass_context
def urscript(context: click.Context, file: str, output: str) -> None:
    """Write the lines of a mapping FILE for the robot program: the watchdog that stops it when the gateway or a
    required writer is gone.
    """
    from gatewayd.links.robot.urscript import watchdog_script

    plan = _plan(context, file)
    if robot_of(plan).watchdog is None:
        _stop(
            context,
            f"{plan.source}: the mapping declares no watchdog: add `watchdog:` to the section `robot`",
        )
    _write(context, output, watchdog_script(plan))


def _node(context: click.Context, file: str) -> tuple[Plan, CanopenPlan]:
    plan = _plan(context, file)
    canopen = canopen_of(plan)
    if canopen is None:
        _stop(
            context,
            f"{plan.source}: the cell is on no CAN bus: "
            "add `canopen: {channel: can0, bitrate: 500000, node: 16}`",
        )
    return plan, canopen


def _read_back(context: click.Context, text: str, dictionary: Dictionary, plan: CanopenPlan) -> None:
    """Let no sheet out that another implementation understands otherwise."""
    from gatewayd.canopen.importer import differences

    found = differences(text, dictionary, plan.node)
    if found:
        _stop(context, f"not written, because python-canopen reads it otherwise: {'; '.join(found[:3])}")


def _plan(context: click.Context, file: str) -> Plan:
    import sys
    from pathlib import Path

    from gatewayd.mapping.loader import load, read_bytes
    from gatewayd.mapping.source import MAXIMUM_BYTES
    from gatewayd.report.findings import Outcome, as_text

    name = "stdin" if file == STDIN else str(click.format_filename(file))
    try:
        data = sys.stdin.buffer.read(MAXIMUM_BYTES + 1) if file == STDIN else read_bytes(Path(file))
    except (OSError, ValueError) as error:
        _fail(context, f"{name}: cannot be read: {_reason(error)}")
    loaded = load(data, name)
    if loaded.plan is None:
        click.echo(as_text(Outcome((name,), loaded.diagnostics)), nl=False, err=True)
        context.exit(BROKEN)
    return loaded.plan


def _write(context: click.Context, output: str, text: str) -> None:
    from pathlib import Path

    if output == STDOUT:
        click.echo(text, nl=False)
        return
    try:
        Path(output).write_text(text, encoding="ascii", newline="\n")
    except (OSError, ValueError) as error:
        _fail(context, f"{click.format_filename(output)}: cannot be written: {_reason(error)}")


def _reason(error: OSError | ValueError) -> str:
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


def _stop(context: click.Context, message: str) -> NoReturn:
    click.echo(printable(message), err=True)
    context.exit(BROKEN)


def _fail(context: click.Context, message: str) -> NoReturn:
    click.echo(printable(message), err=True)
    context.exit(UNREADABLE)
