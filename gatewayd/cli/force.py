"""`gatewayd force`: put a value in place of what a variable's source reports, for commissioning, with a time limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.remote import (
    DURATION,
    cell_option,
    complete_variables,
    on_gateway,
    readable,
)

if TYPE_CHECKING:
    from gatewayd.control.client import Client

_TRUTHS = {"true": True, "on": True, "false": False, "off": False}


@click.command(
    name="force",
    context_settings={"ignore_unknown_options": True},
    epilog="""\b
Examples:
  gatewayd force part_number 7 --for 30s      the robot gets 7; PLC writes to it are refused meanwhile
  gatewayd force cycles 99 --for 5min         the PLC reads 99, with quality `forced`
  gatewayd force 'tcp[2]' -0.25
  gatewayd unforce part_number                end it now

\b
Exit codes:
  0  forced
  1  refused: limits, robot not connected, register not ours
  2  wrong usage, or no gateway could be reached
""",
)
@click.argument("name", shell_complete=complete_variables)
@click.argument("value")
@click.option(
    "--for",
    "seconds",
    type=DURATION,
    default="1min",
    show_default=True,
    metavar="TIME",
    help="How long, at most 24h.",
)
@on_gateway
@cell_option
def command(client: Client, name: str, value: str, seconds: float, cell: str | None) -> None:
    """Force variable NAME to VALUE (a number in the robot's unit, or on or off).

    Input: the robot gets the value, and its lock is yours for this time; afterwards it takes its release fallback until
    its owner writes. Output: the fieldbus sees the value, and afterwards again what the robot reports. Declared limits
    apply.
    """
    from gatewayd.control.client import segment
    from gatewayd.report.format import span
    from gatewayd.report.format import value as shown

    body = {"value": _parse(value), "for": seconds, "cell": cell}
    found = readable(client.post(f"/v1/variables/{segment(name)}/force", body))
    side = "the robot gets it" if found["direction"] == "input" else "the fieldbus sees it"
    click.echo(
        f"{found['name']} is forced to {shown(found['value'], found['unit'])} for {span(seconds)}: {side}"
    )
    if found["quality"] != "forced":
        click.echo(f"but its quality is {found['quality']}", err=True)


def _parse(text: str) -> bool | int | float:
    truth = _TRUTHS.get(text.lower())
    if truth is not None:
        return truth
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    raise click.BadParameter(
        f"{text!r} is neither a number nor on or off: write 7, 0.5, on or off", param_hint="VALUE"
    )
