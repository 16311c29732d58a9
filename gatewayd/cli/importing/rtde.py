"""`gatewayd import rtde`: a mapping file from a recipe of the Python or the C++ RTDE client."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import reason_of
from gatewayd.cli.importing.defaults import cell_name, cell_options, listen_address, output_options
from gatewayd.cli.output import refuse_existing, write_text
from gatewayd.report.format import counted
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.rtde.recipes import DeclaredRecipe

FOUND, WRONG = 1, 2
"""Exit codes."""


@click.command(
    name="rtde",
    epilog="""\b
Examples:
  gatewayd import rtde record_configuration.xml --host 192.0.2.10 -o press.yaml
  gatewayd import rtde control_loop_configuration.xml --host 192.0.2.10 --writer 192.0.2.20 -o press.yaml
  gatewayd import rtde rtde_output_recipe.txt --host robot.local              to standard output
  gatewayd import rtde --recipe out configuration.xml --host 192.0.2.10      one recipe of several

\b
Exit codes:
  0  everything was carried over
  1  something cannot be carried over, each field listed with file and line; nothing was written, or the rest
     of it with --leave-out
  2  wrong usage, a file that cannot be read or written, or OUT exists
""",
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, readable=True))
@click.option("--host", required=True, metavar="HOST", help="Name or IP address of the robot's controller.")
@click.option(
    "--recipe", "keys", multiple=True, metavar="KEY", help="Only this recipe; may be given several times."
)
@click.option("--writer", metavar="ADDRESS", help="IP address of the PLC that may write the recipe's inputs.")
@click.option(
    "--listen",
    metavar="ADDRESS:PORT",
    help="Where the PLC connects to; otherwise port 502, from other machines only if the writer is one.",
)
@cell_options
@click.option("--frequency", metavar="HZ", type=click.FloatRange(0, 500), help="Packages per second.")
@click.option("--float32", "single", is_flag=True, help="Reals in two registers each; exact ones take four.")
@click.option("--leave-out", is_flag=True, help="Write the rest where something cannot be carried over.")
@output_options
@click.pass_context
def command(
    context: click.Context,
    file: str,
    *,
    host: str,
    out: str | None,
    keys: tuple[str, ...],
    writer: str | None,
    listen: str | None,
    cell: str | None,
    series: str | None,
    version: str | None,
    frequency: float | None,
    single: bool,
    leave_out: bool,
    force: bool,
) -> None:
    """Make a mapping file from FILE, a recipe of the Python client (XML) or of the C++ client (text).

    Each field becomes a variable of its name, with consecutive Modbus registers: what is written to the robot from 0
    on, what it sends from 1000 on. The result passes `gatewayd check`. What a recipe does not say has to be given: the
    robot's address, and who may write its inputs.
    """
    from gatewayd.cli.importing.recipe import ImportSettings, imported, mapping_text

    if out is not None:
        refuse_existing(out, overwrite=force)
    fields, findings = imported(_recipes(context, file, keys))
    for finding in findings:
        click.echo(printable(str(finding)), err=True)
    left = sum(finding.is_error for finding in findings)
    if left and not leave_out:
        click.echo("nothing was written; --leave-out writes the rest", err=True)
        context.exit(FOUND)
    has_inputs = any(field.is_input for field in fields)
    if has_inputs and writer is None:
        raise click.UsageError(
            "the recipe has inputs: name the PLC that may write them with --writer ADDRESS"
        )
    settings = ImportSettings(
        cell=cell if cell is not None else cell_name(file),
        host=host,
        listen=listen if listen is not None else listen_address([writer] if writer is not None else []),
        writer=writer if has_inputs else None,
        frequency=frequency,
        series=series,
        version=version,
        single=single,
    )
    _write(context, mapping_text(fields, settings, Path(file).name), out)
    if left:
        context.exit(FOUND)


def _recipes(context: click.Context, file: str, keys: Sequence[str]) -> list[DeclaredRecipe]:
    from gatewayd.rtde.recipes import RecipeFileError, read_recipes

    try:
        found = read_recipes(file)
        return [found.recipe(key) for key in dict.fromkeys(keys)] or list(found.recipes.values())
    except RecipeFileError as error:
        click.echo("\n".join(printable(line) for line in str(error).splitlines()), err=True)
        context.exit(FOUND)
    except OSError as error:
        click.echo(printable(f"{file}: cannot be read: {reason_of(error)}"), err=True)
        context.exit(WRONG)


def _write(context: click.Context, text: str, out: str | None) -> None:
    """Write what passes the check; its findings are printed, and errors among them leave nothing written."""
    from gatewayd.mapping.loader import load
    from gatewayd.report.findings import CheckOutcome, as_text

    name = out if out is not None else "stdout"
    loaded = load(text.encode(), name)
    if loaded.plan is None:
        click.echo(as_text(CheckOutcome((name,), loaded.diagnostics)), nl=False, err=True)
        click.echo("nothing was written: a mapping with these errors cannot start", err=True)
        context.exit(FOUND)
    if out is None:
        click.echo(text, nl=False)
        return
    write_text(context, out, text)
    warnings = len(loaded.diagnostics)
    remark = f"; {counted(warnings, 'warning')}, see: gatewayd check {out}" if warnings else ""
    click.echo(printable(f"{out}: {counted(len(loaded.plan.cell.variables), 'variable')}{remark}"))
