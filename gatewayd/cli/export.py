"""`gatewayd export`: what other tools need of a cell, made from its mapping file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import click

from gatewayd.cli.files import load_plan, reason_of
from gatewayd.cli.output import write_text
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from gatewayd.links.exports import AnyExport, Export, ExportedFile, ExportOption, ExportSet

_Made = TypeVar("_Made")

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
        return None if export is None else _command(export)


@click.group(
    name="export",
    cls=ExportGroup,
    epilog="""\b
Examples:
  gatewayd export eds my-cell.yaml -o my-cell.eds      for the CANopen master's configurator
  gatewayd export dcf my-cell.yaml -o my-cell.dcf      the same with node-ID, bit-rate and values
  gatewayd export urscript my-cell.yaml                functions for the robot program
  gatewayd export plc my-cell.yaml --for iec-st -o plc/   data types and code for a PLC
  gatewayd show --format csv my-cell.yaml              the register list, for a spreadsheet
""",
)
def command() -> None:
    """Write files for other tools from a mapping FILE: the CANopen data sheet, robot and PLC programs."""


def _command(export: AnyExport) -> click.Command:
    """A command: what is common to all, and where it writes."""
    from inspect import cleandoc

    from gatewayd.links.exports import ExportSet

    is_set = isinstance(export, ExportSet)
    examples = "\n".join(f"  {example}" for example in export.examples)
    return click.Command(
        export.name,
        callback=_into_folder(export) if isinstance(export, ExportSet) else _into_file(export),
        params=[
            click.Argument(["file"], type=click.Path(allow_dash=True)),
            *map(_option, export.options),
            *((_option(export.link_option),) if isinstance(export, ExportSet) else ()),
            *(_FOLDER_OPTIONS if is_set else _FILE_OPTIONS),
        ],
        help=cleandoc(export.help),
        short_help=export.summary,
        epilog=f"\b\nExamples:\n{examples}\n\n{_EXIT_CODES}",
    )


_FILE_OPTIONS = (
    click.Option(
        ["-o", "--output"],
        metavar="OUT",
        type=click.Path(allow_dash=True),
        default=STDOUT,
        help="Where to write it; standard output otherwise.",
    ),
)
_FOLDER_OPTIONS = (
    click.Option(
        ["-o", "--output"],
        metavar="FOLDER",
        type=click.Path(file_okay=False),
        default=".",
        show_default=True,
        help="Where to write the files; it is made where there is none.",
    ),
    click.Option(["--force"], is_flag=True, help="Overwrite generated files that somebody changed."),
)


def _into_file(export: Export) -> Callable[..., None]:
    def run(file: str, output: str, **options: object) -> None:
        context = click.get_current_context()
        text = _made(context, export.make, file, options)
        if output == STDOUT:
            click.echo(text, nl=False)
        else:
            write_text(context, output, text, encoding="ascii")

    return run


def _into_folder(export: ExportSet) -> Callable[..., None]:
    def run(file: str, output: str, force: bool, **options: object) -> None:
        context = click.get_current_context()
        _write_set(context, _made(context, export.make, file, options), output, force=force)

    return run


def _option(option: ExportOption) -> click.Option:
    # To click a default of None is a default too, with which no option is missing.
    default: dict[str, Any] = {} if option.default is None else {"default": option.default}
    return click.Option(
        [option.flag, option.name],
        help=option.help,
        metavar=option.metavar or None,
        type=click.Choice(option.choices) if option.choices else None,
        show_default=option.default is not None,
        required=option.required,
        multiple=option.multiple,
        is_flag=not option.metavar,
        **default,
    )


def _write_set(context: click.Context, made: Sequence[ExportedFile], output: str, *, force: bool) -> None:
    from pathlib import Path

    from gatewayd.cli.generated import planned, write

    try:
        files = planned(Path(output), made, force=force)
        changed = [each for each in files if each.state == "changed by hand"]
        if not changed:
            write(files)
    except OSError as error:
        where = click.format_filename(error.filename or output)
        click.echo(printable(f"{where}: cannot be written: {reason_of(error)}"), err=True)
        context.exit(UNREADABLE)
    for each in changed:
        text = f"{each.path}: changed by hand, so nothing was written: move the change elsewhere, or --force"
        click.echo(printable(text), err=True)
    if changed:
        context.exit(BROKEN)
    for each in files:
        click.echo(printable(f"{each.path}: {each.state}"))


def _made(
    context: click.Context, make: Callable[..., _Made], file: str, options: Mapping[str, object]
) -> _Made:
    """What an export makes of a mapping; each line of why it does not is said, and ends the command."""
    from gatewayd.links.exports import ExportError

    try:
        return make(load_plan(context, file)[1], **options)
    except ExportError as error:
        for line in str(error).splitlines():
            click.echo(printable(line), err=True)
        context.exit(BROKEN)
