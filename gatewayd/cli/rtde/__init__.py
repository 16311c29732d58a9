"""`gatewayd rtde`: what a person does with a robot's RTDE interface; one module for each command."""

from __future__ import annotations

import click

from gatewayd.cli.lazy import LazyGroup

COMMANDS: dict[str, str] = {
    "record": "Record every package of a robot in a file.",
    "watch": "Watch fields of a robot live.",
    "get": "Print what fields of a robot hold now.",
    "set": "Write inputs of a robot, verified by reading back.",
    "message": "Put a line into a controller's log.",
    "fields": "Print which fields a controller has, and of what type.",
    "info": "Print what a controller is, and how it speaks RTDE.",
    "convert": "Write a finished recording in another format.",
    "plot": "Draw a recording: PNG, SVG or PDF.",
}
"""Name -> what the list of commands says. Module `gatewayd.cli.rtde.NAME` has the click command as `command`."""


@click.group(name="rtde", cls=LazyGroup, package="gatewayd.cli.rtde", summaries=COMMANDS)
def command() -> None:
    """Work with a robot's RTDE interface directly, without a mapping file."""
