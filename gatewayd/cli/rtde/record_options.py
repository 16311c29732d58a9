"""What the options of `gatewayd rtde record` mean together; UsageError for what contradicts itself."""

from __future__ import annotations

import time

import click

from gatewayd.cli.rtde.conditions import Condition
from gatewayd.cli.rtde.field_choice import Fields, named, of_file
from gatewayd.cli.rtde.recordings import typed
from gatewayd.cli.rtde.target import TARGET, Target
from gatewayd.cli.rtde.triggers import Conditions
from gatewayd.rtde.session import TIMESTAMP


def target_of(
    context: click.Context,
    host: str | None,
    *,
    gateway: bool,
    cell: str | None,
    frequency: float,
) -> Target | None:
    """The robot; None: the gateway's."""
    if gateway:
        if host is not None:
            raise click.UsageError("a gateway knows its robot: leave HOST out, or --gateway")
        if frequency:
            raise click.UsageError("the gateway's session has the rate of its mapping: leave --frequency out")
        return None
    if host is None:
        raise click.UsageError("name the robot's HOST, or record a running gateway's with --gateway")
    if cell is not None:
        raise click.UsageError("--cell is for --gateway")
    if typed(context, "socket"):
        raise click.UsageError("--socket is for --gateway")
    return TARGET.convert(host, None, context)


def conditions_of(
    during: Condition | None,
    start: Condition | None,
    stop: Condition | None,
    *,
    once: bool,
    before: float | None,
    after: float | None,
) -> Conditions:
    """What starts and stops the recording."""
    if during is not None and (start is not None or stop is not None):
        raise click.UsageError("--while is a start and a stop by itself: leave --start and --stop out")
    if once and during is None:
        raise click.UsageError("--once is for --while")
    if before is not None and during is None and start is None:
        raise click.UsageError("--before needs a condition that recording begins with: --while or --start")
    if after is not None and during is None and stop is None:
        raise click.UsageError("--after needs a condition that recording ends with: --while or --stop")
    return Conditions(during, start, stop, once)


def fields_of(names: tuple[str, ...], config: str | None, key: str | None) -> Fields:
    """What is to be recorded; none: what is usual."""
    if config is not None:
        if names:
            raise click.UsageError("--config has the fields: leave --fields out")
        return of_file(config, key)
    if key is not None:
        raise click.UsageError("--key is for --config")
    found = named(names)
    return dict.fromkeys((TIMESTAMP, *(name for name in found if name != TIMESTAMP))) if found else {}


def default_name(host: str, *, binary: bool) -> str:
    """`rtde-192.0.2.10-20261129-141500.csv`, in the present directory."""
    safe = "".join(letter if letter.isalnum() or letter in ".-_" else "-" for letter in host)
    return f"rtde-{safe}-{time.strftime('%Y%m%d-%H%M%S')}{'.bin' if binary else '.csv'}"
