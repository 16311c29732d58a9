"""`gatewayd rtde get`: what fields hold at this moment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.rtde.target import TARGET, Target

if TYPE_CHECKING:
    from gatewayd.cli.rtde.value_rows import Value

_PATIENCE = 3.0
"""Seconds to wait for the first package."""


@click.command(
    name="get",
    epilog="""\b
Examples:
  gatewayd rtde get 192.0.2.10 runtime_state safety_mode actual_TCP_pose
  gatewayd rtde get 192.0.2.10 input_int_register_24        what an input holds; nothing is claimed
  gatewayd rtde get 192.0.2.10 --json actual_q | jq .values.actual_q[5]

\b
Exit codes:
  0  printed
  1  the robot was not reached, or lacks a field
  2  wrong usage
""",
)
@click.argument("host", type=TARGET)
@click.argument("fields", nargs=-1, required=True, metavar="FIELD...")
@click.option("--json", "as_json", is_flag=True, help="Print exact values as JSON, for programs.")
def command(host: Target, fields: tuple[str, ...], *, as_json: bool) -> None:
    """Print once what the FIELDs of the robot at HOST hold: outputs, and inputs that can be read back.

    `gatewayd rtde fields HOST` lists the names. Nothing is written and nothing claimed.
    """
    import asyncio

    from gatewayd.cli.rtde.field_choice import named
    from gatewayd.cli.rtde.robots import failures

    names = named(fields)
    with failures():
        timestamp, values = asyncio.run(_read(host, names))
    _print(host, timestamp, values, as_json=as_json)


async def _read(host: Target, names: tuple[str, ...]) -> tuple[float, dict[str, Value]]:
    from gatewayd import rtde

    async with rtde.connect(host[0], port=host[1], outputs=names, reconnect=None) as robot:
        sample = await robot.newer(_PATIENCE)
        return sample.timestamp, {name: sample[name] for name in names}


def _print(host: Target, timestamp: float, values: dict[str, Value], *, as_json: bool) -> None:
    from gatewayd.cli.printing import echo
    from gatewayd.cli.rtde import value_rows
    from gatewayd.report.format import address
    from gatewayd.report.printable import json_document, printable

    if as_json:
        found = {name: value_rows.as_json(value) for name, value in values.items()}
        document = {"version": 1, "robot": address(*host), "timestamp": timestamp, "values": found}
        click.echo(json_document(document), nl=False)
        return
    for line in value_rows.lines([value_rows.value_row(name, value) for name, value in values.items()]):
        echo(printable(line))
