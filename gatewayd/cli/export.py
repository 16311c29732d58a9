"""`gatewayd export`: what other tools need of a cell, made from its mapping file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import load_plan, reason_of
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gatewayd.links.exports import Export, ExportOption

BROKEN, UNREADABLE = 1, 2
"""Exit codes."""
STDOUT = "-"
"""The file name that stands for standard output."""

_EXIT_CODES = """\
\b
Exit codes:
  0  written
  1  the file has errors (they are listed), or it has nothing of what is asked for
  2  wrong usage, or a file that cannot be read or written
"""


class ExportGroup(click.Group):
    """One command for each file that some kind of link writes; what writes it is imported to use it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names in order."""
        from gatewayd.links.registry import exports

        return sorted(exports())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name; None when there is none."""
        from gatewayd.links.registry import exports

        export = exports().get(cmd_name)
        return _command(export) if export is not None else None


@click.group(
    name="export",
    cls=ExportGroup,
    epilog="""\b
Examples:
  gatewayd export eds my-cell.yaml -o my-cell.eds      for the CANopen master's configurator
  gatewayd export dcf my-cell.yaml -o my-cell.dcf      the same with node-ID, bit-rate and values
  gatewayd export urscript my-cell.yaml                functions for the robot program
  gatewayd show --format csv my-cell.yaml              the register list, for a spreadsheet
""",
)
def command() -> None:
    """Write files for other tools from a mapping FILE: the CANopen data sheet, functions for the robot program."""


def _command(export: Export) -> click.Command:
    from inspect import cleandoc

    def run(file: str, output: str, **options: object) -> None:
        context = click.get_current_context()
        _write(context, output, _made(context, export, file, options))

    return click.Command(
        export.name,
        callback=run,
        params=[
            click.Argument(["file"], type=click.Path(allow_dash=True)),
            *map(_option, export.options),
            click.Option(
                ["-o", "--output"],
                metavar="OUT",
                type=click.Path(allow_dash=True),
                default=STDOUT,
                help="Where to write it; standard output otherwise.",
            ),
        ],
        help=cleandoc(export.help),
        short_help=export.summary,
        epilog=f"\b\nExamples:\n  {export.example}\n\n{_EXIT_CODES}",
    )


def _option(option: ExportOption) -> click.Option:
    return click.Option(
        [option.flag, option.name],
        help=option.help,
        metavar=option.metavar or None,
        type=click.Choice(option.choices) if option.choices else None,
        default=option.default,
        show_default=option.default is not None,
        required=option.required,
        multiple=option.multiple,
        is_flag=not option.metavar,
    )


def _made(context: click.Context, export: Export, file: str, options: Mapping[str, object]) -> str:
    from gatewayd.links.exports import ExportError

    try:
        return export.make(load_plan(context, file)[1], **options)
    except ExportError as error:
        click.echo(printable(str(error)), err=True)
        context.exit(BROKEN)


def _write(context: click.Context, output: str, text: str) -> None:
    from pathlib import Path

    if output == STDOUT:
        click.echo(text, nl=False)
        return
    try:
        Path(output).write_text(text, encoding="ascii", newline="\n")
    except (OSError, ValueError) as error:
        message = f"{click.format_filename(output)}: cannot be written: {reason_of(error)}"
        click.echo(printable(message), err=True)
        context.exit(UNREADABLE)
