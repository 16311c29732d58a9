"""`gatewayd doctor`: what is wrong, from this machine to the robot and to the side of the PLC, and what to do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.files import mapping_files, read_named

if TYPE_CHECKING:
    from collections.abc import Callable

    from gatewayd.control.running import RunningGateways
    from gatewayd.doctor.report import CheckLine, DoctorReport
    from gatewayd.mapping.loader import Loaded

WELL, FOUND, UNREADABLE = 0, 1, 2
"""Exit codes."""
_COLOURS = {"ok": "green", "warning": "yellow", "problem": "red"}


@click.command(
    name="doctor",
    epilog="""\b
Examples:
  gatewayd doctor my-cell.yaml                  look at all that the mapping needs
  gatewayd doctor /etc/gatewayd                 the same for all mapping files of a directory
  gatewayd doctor --probe-claims my-cell.yaml   see which inputs others hold, and who that probably is
  gatewayd doctor --json my-cell.yaml           for programs

\b
What is looked at, each within some seconds:
  gateway   does one run here, what does it say, does it serve this mapping
  robot     name, route, port, RTDE service, protocol, software, each field, claims, rate of the data, its last texts
  modbus    address and port of the listener, privilege, who has the port, the way to each declared client
  canopen   interface, bus state, bit rate, restart after bus-off, frames on the bus, the node-ID

\b
Exit codes:
  0  all is well
  1  something is to be done, or a mapping has errors
  2  wrong usage, or a file that cannot be read (the others are looked at all the same)
""",
)
@click.argument("files", nargs=-1, required=True, type=click.Path(allow_dash=True))
@click.option(
    "--probe-claims",
    is_flag=True,
    help="Claim the inputs of the mapping for a moment, to see which of them others hold. Only for that moment they "
    "are taken from others; nothing is written. Not those that a gateway on this machine holds.",
)
@click.option(
    "--socket",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_CONTROL",
    help="Control socket of the gateway on this machine. Default: all that are found.",
)
@click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON document, when everything was looked at."
)
@click.pass_context
def command(
    context: click.Context, files: tuple[str, ...], socket: Path | None, *, probe_claims: bool, as_json: bool
) -> None:
    """Find out why a cell does not work: from this machine to the robot, and to the side of the PLC.

    It looks at what the mapping FILES need, prints a line for each check as it proceeds, and ends with what to do, the
    most important first. It changes nothing: to the robot it connects and reads, and it claims no inputs without
    --probe-claims. A gateway on this machine is asked, and what it holds does not count as held by others.
    """
    import os

    from gatewayd.control.running import ask, sockets
    from gatewayd.doctor.report import as_json as document_of

    loaded, unreadable = _load(files)
    gateways = ask(sockets(socket, os.environ))
    report = _look(loaded, gateways, _quiet if as_json else _Printer().line, probe_claims=probe_claims)
    report.unreadable = unreadable
    if as_json:
        click.echo(document_of(report), nl=False)
    else:
        _print_advice(report)
    if unreadable:
        context.exit(UNREADABLE)
    context.exit(FOUND if report.advice else WELL)


def _load(files: tuple[str, ...]) -> tuple[tuple[Loaded, ...], tuple[tuple[str, str], ...]]:
    from gatewayd.mapping.loader import load_together

    readable: list[tuple[str, bytes]] = []
    unreadable: list[tuple[str, str]] = []
    for name, content in map(read_named, mapping_files(files)):
        if isinstance(content, bytes):
            readable.append((name, content))
        else:
            unreadable.append((name, content.reason))
    return load_together(readable), tuple(unreadable)


def _look(
    loaded: tuple[Loaded, ...],
    gateways: RunningGateways,
    show: Callable[[str, CheckLine], None],
    *,
    probe_claims: bool,
) -> DoctorReport:
    """Look at all of it, and show each line as it comes."""
    import asyncio

    from gatewayd.doctor.examine import about_machine, about_mapping, examine
    from gatewayd.doctor.report import DoctorReport

    report = DoctorReport(tuple(mapping.name for mapping in loaded))

    def note(file: str, line: CheckLine) -> None:
        report.lines.append(line)
        show(file, line)

    async def look() -> None:
        for line in about_machine(gateways):
            note("", line)
        for mapping in loaded:
            note(mapping.name, about_mapping(mapping))
            if mapping.plan is not None:
                async for line in examine(mapping.plan, gateways, probe_claims=probe_claims):
                    note(mapping.name, line)

    asyncio.run(look())
    return report


def _quiet(_file: str, _line: CheckLine) -> None:
    """Show nothing: the document comes at the end."""


class _Printer:
    """Prints lines as they come, below the name of their cell."""

    def __init__(self) -> None:
        self._heading: tuple[str, str] | None = None

    def line(self, file: str, line: CheckLine) -> None:
        """One line."""
        from gatewayd.cli.printing import echo
        from gatewayd.doctor.report import line_text
        from gatewayd.report.printable import printable

        if (file, line.cell) != self._heading:
            self._heading = file, line.cell
            name = f"{line.cell} ({file})" if line.cell else file or "this machine"
            echo(click.style(printable(name), bold=True))
        head, outcome, text = line_text(line)
        colour = _COLOURS.get(outcome.strip())
        echo(f"{head}{click.style(outcome, fg=colour) if colour else outcome}{text}")


def _print_advice(report: DoctorReport) -> None:
    from gatewayd.cli.printing import echo
    from gatewayd.doctor.report import advice_text
    from gatewayd.report.printable import printable

    for file, reason in report.unreadable:
        click.echo(printable(f"{file}: cannot be read: {reason}"), err=True)
    click.echo()
    for text in advice_text(report):
        echo(text)
