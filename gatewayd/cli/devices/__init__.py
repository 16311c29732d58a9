"""`gatewayd devices`: the devices that the gateway talks to by itself; found on a line, and asked by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.lazy import LazyGroup
from gatewayd.cli.remote import cell_option, echo_json, json_option, on_gateway, readable

if TYPE_CHECKING:
    from gatewayd.control.client import Client

COMMANDS = {
    "scan": "Find the units or nodes that answer on a line.",
    "read": "Read a place of a device.",
    "write": "Write a place of a device that no variable is mapped to.",
}
"""Name -> what the list of commands says. Module `gatewayd.cli.devices.NAME` has the click command as `command`."""
DEGRADED = 1
"""Exit code when a device is not as it should be."""


class DevicesGroup(LazyGroup):
    """Takes `--scan` for `scan`, and so on: what is asked for first is a command, however it is spelt."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """See click.Command."""
        for place, argument in enumerate(args):
            name, _, rest = argument.removeprefix("--").partition("=")
            if argument.startswith("--") and name in COMMANDS:
                args[place : place + 1] = [name, rest] if rest else [name]
                break
            if argument in COMMANDS:
                break
        return super().parse_args(ctx, args)


@click.group(
    name="devices",
    cls=DevicesGroup,
    package="gatewayd.cli.devices",
    summaries=COMMANDS,
    invoke_without_command=True,
    epilog="""\b
Examples:
  gatewayd devices                                  each device: state, round trip, time-outs, refusals
  gatewayd devices --cell press --json              for programs
  gatewayd devices scan 127.0.0.1:502               which units answer there; no gateway is needed
  gatewayd devices read island holding:100..103     through the running gateway
  gatewayd devices write island coil:9 on           only where no variable is mapped

\b
Exit codes:
  0  all devices are good, or there are none
  1  a device is lost, or there in part
  2  wrong usage, or no gateway could be reached
""",
)
@on_gateway
@cell_option
@json_option
@click.pass_context
def command(context: click.Context, client: Client, cell: str | None, *, as_json: bool) -> None:
    """Print the devices that the running gateway talks to by itself: I/O islands, grippers, encoders, drives.

    The subcommands find devices on a line, read one and write to it.
    """
    if context.invoked_subcommand is not None:
        return
    from gatewayd.cli.devices.table import devices_of, lines

    found = devices_of(client.get("/v1/status"), cell)
    if as_json:
        echo_json(found)
    else:
        for line in lines(readable(found)):
            click.echo(line)
    if any(device["state"] != "good" for device in found):
        context.exit(DEGRADED)
