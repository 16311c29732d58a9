"""`gatewayd events`: what has happened, and what happens."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import click

from gatewayd.cli.remote import (
    UNREACHABLE,
    cell_option,
    echo_json,
    json_option,
    on_gateway,
    readable,
)

if TYPE_CHECKING:
    from gatewayd.control.client import Client


@click.command(
    name="events",
    epilog="""\b
Examples:
  gatewayd events                          the last 20
  gatewayd events --follow                 and everything that happens from now on
  gatewayd events --follow --json | jq -r 'select(.event=="write refused") | .variable'
  gatewayd events --audit --limit 100      who wrote what: old and new values

\b
Exit codes:
  0  printed
  1  refused
  2  wrong usage, or no gateway could be reached; with --follow, it has ended
""",
)
@on_gateway
@cell_option
@click.option("-f", "--follow", is_flag=True, help="Go on with what happens, until Ctrl-C.")
@click.option(
    "-n", "--limit", type=click.IntRange(0, 1000), default=20, show_default=True, help="So many former ones."
)
@click.option("--audit", is_flag=True, help="The audit instead: accepted and refused writes.")
@json_option
@click.pass_context
def command(
    context: click.Context,
    client: Client,
    cell: str | None,
    *,
    follow: bool,
    limit: int,
    audit: bool,
    as_json: bool,
) -> None:
    """Print the last events of the running gateway: links, locks, refusals, fallbacks, forces."""
    if follow and audit:
        raise click.UsageError("--audit cannot be followed; gatewayd run --audit FILE writes a file that can")
    found: Iterable[Mapping[str, Any]]
    if audit:
        found = client.get("/v1/audit", limit=limit, cell=cell)["records"]
    elif follow:
        found = client.follow("/v1/events", follow=1, limit=limit, cell=cell)
    else:
        found = client.get("/v1/events", limit=limit, cell=cell)["events"]
    for event in found:
        _print(event, as_json=as_json)
    if follow:
        click.echo("the gateway has ended", err=True)
        context.exit(UNREACHABLE)


def _print(found: Mapping[str, Any], *, as_json: bool) -> None:
    from gatewayd.cli.phrases import clock

    if as_json:
        echo_json(found, indent=None)
        return
    found = readable(found)
    text = click.style(found["text"], fg="yellow" if found["bad"] else None)
    click.echo(f"{clock(found['time'])} {found['cell']}  {text}")
