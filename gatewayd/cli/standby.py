"""`gatewayd standby`: which of two gateways serves a cell, and hand it over."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import click

from gatewayd.cli.remote import RemoteError, cell_option, echo_json, json_option, on_gateway, readable

if TYPE_CHECKING:
    from gatewayd.control.client import Client

KEY = "standby"
_LOOK = 0.02
_PATIENCE = 5.0
"""Seconds within which the other gateway has to serve the cell."""
_SERVING = ("taking address", "active")


@click.group(
    name="standby",
    invoke_without_command=True,
    epilog="""\b
Examples:
  gatewayd standby
  gatewayd standby switch                  before this machine is updated
  gatewayd standby switch --cell press-3

\b
Exit codes:
  0  printed, handed over
  1  refused: the other gateway is not ready
  2  wrong usage, or no gateway could be reached
""",
)
@on_gateway
@cell_option
@json_option
@click.pass_context
def command(context: click.Context, client: Client, cell: str | None, *, as_json: bool) -> None:
    """Print for each cell with a second gateway which of the two serves it, and whether the other could."""
    if context.invoked_subcommand is not None:
        return
    found = dict(_cells(client, cell))
    if as_json:
        echo_json(found)
        return
    if not found:
        click.echo("no cell here has a second gateway (`standby:` in the mapping)")
    for name, standby in readable(found).items():
        other = standby["peer_role"] or "not heard"
        can = (
            "can be handed over"
            if not standby["obstacle"]
            else f"cannot be handed over: {standby['obstacle']}"
        )
        click.echo(f"{name}: this gateway is {standby['role']}, the other one {other}; {can}")


@command.command(
    name="switch",
    short_help="Hand a cell over to the other gateway.",
    epilog="""\b
Example:
  gatewayd standby switch && sudo apt upgrade gatewayd
""",
)
@on_gateway
@cell_option
def switch(client: Client, cell: str | None) -> None:
    """Hand every cell that this gateway serves, or the one of --cell, over to the other gateway.

    Inputs keep their values in the robot, forces end, and connections of Modbus clients do too. Refused while the other
    gateway is not ready: it is not heard, has another mapping, or does not reach the robot.
    """
    from gatewayd.control.client import segment

    pairs = list(_cells(client, cell))
    if not pairs:
        raise RemoteError(f"{cell or 'no cell here'} has no second gateway (`standby:` in the mapping)")
    served = [name for name, standby in pairs if cell or standby["role"] == "active"]
    if not served:
        roles = ", ".join(f"{name} is {standby['role']}" for name, standby in pairs)
        raise RemoteError(f"this gateway serves no cell that could be handed over: {roles}")
    for name in served:
        began = time.monotonic()
        client.post(f"/v1/cells/{segment(name)}/hand-over", {})
        if _serves_elsewhere(client, name, began):
            took = time.monotonic() - began
            click.echo(f"{readable(name)}: the other gateway serves the cell, after {took * 1000:.0f} ms")
        else:
            raise RemoteError(
                f"{name} was handed over, and the other gateway does not serve it: see its status"
            )


def _cells(client: Client, cell: str | None) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for found in client.get("/v1/status")["cells"]:
        if found.get(KEY) and cell in (None, found["name"]):
            yield found["name"], found[KEY]


def _serves_elsewhere(client: Client, name: str, began: float) -> bool:
    while time.monotonic() - began < _PATIENCE:
        if any(standby["peer_role"] in _SERVING for _, standby in _cells(client, name)):
            return True
        time.sleep(_LOOK)
    return False
