"""What the tests of commands that talk to one robot share."""

from __future__ import annotations

from click.testing import CliRunner, Result

from gatewayd.cli import command
from tests.e2e.processes import HOST, Simulator


def rtde(*arguments: str) -> Result:
    """`gatewayd rtde ARGUMENTS` in this process."""
    return CliRunner().invoke(command, ("rtde", *arguments), prog_name="gatewayd")


def place(simulator: Simulator) -> str:
    return f"{HOST}:{simulator.port}"
