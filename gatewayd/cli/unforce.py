"""`gatewayd unforce`: end a force before its time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.remote import cell_option, complete_variables, on_gateway, readable

if TYPE_CHECKING:
    from gatewayd.control.client import Client


@click.command(
    name="unforce",
    epilog="""\b
Examples:
  gatewayd unforce part_number
  gatewayd unforce --all

\b
Exit codes:
  0  ended
  1  it is not forced
  2  wrong usage, or no gateway could be reached
""",
)
@click.argument("name", required=False, shell_complete=complete_variables)
@click.option("--all", "every", is_flag=True, help="End every force.")
@on_gateway
@cell_option
def command(client: Client, name: str | None, cell: str | None, *, every: bool) -> None:
    """End the force of variable NAME: an output shows what the robot reports again, an input its release fallback."""
    from gatewayd.control.client import segment
    from gatewayd.report.format import value

    if every == (name is not None):
        raise click.UsageError("name one variable, or use --all")
    if name is not None:
        wanted = [(name, cell)]
    else:
        variables = client.get("/v1/variables", cell=cell)["variables"]
        wanted = [(variable["name"], variable["cell"]) for variable in variables if variable["forced"]]
    for forced, its_cell in wanted:
        found = readable(client.post(f"/v1/variables/{segment(forced)}/unforce", {"cell": its_cell}))
        shown = value(found["value"], found["unit"])
        click.echo(f"{found['name']} is no longer forced: {shown}, {found['quality']}")
    if not wanted:
        click.echo("nothing is forced")
