"""`gatewayd import`: mapping files made from files of other tools; one module for each kind of file."""

from __future__ import annotations

import click

from gatewayd.cli.lazy import LazyGroup

COMMANDS = {
    "csv": "Propose a mapping from a register list.",
    "eds": "Propose a mapping from the data sheet of a CANopen device.",
    "rtde": "Make a mapping from a recipe of another RTDE client.",
}
"""Name -> what the list of commands says. Module `gatewayd.cli.importing.NAME` has the click command as `command`."""


@click.group(name="import", cls=LazyGroup, package="gatewayd.cli.importing", summaries=COMMANDS)
def command() -> None:
    """Make a mapping file from files of other tools, with a finding for whatever cannot be carried over."""
