"""`gatewayd rtde record`: every package of a robot into a file."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gatewayd.cli.output import refuse_existing
from gatewayd.cli.remote import DURATION, cell_option, refusals
from gatewayd.cli.rtde.recordings import FAILED, WRONG, delimiter_option, reported, typed
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from gatewayd.cli.rtde.conditions import Condition
    from gatewayd.cli.rtde.field_choice import Fields
    from gatewayd.cli.rtde.progress_lines import ProgressLines
    from gatewayd.cli.rtde.recorder import RecordingOrder
    from gatewayd.cli.rtde.recording_run import RecordingEnd
    from gatewayd.cli.rtde.sources import PackageSource
    from gatewayd.cli.rtde.target import Target


def _condition(_context: click.Context, _parameter: click.Parameter, text: str | None) -> Condition | None:
    from gatewayd.cli.rtde.conditions import ConditionError, parse_condition

    if text is None:
        return None
    try:
        return parse_condition(text)
    except ConditionError as error:
        raise click.BadParameter(str(error)) from error


def _condition_option(
    name: str, variable: str, text: str
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    return click.option(name, variable, metavar="CONDITION", callback=_condition, help=text)


@click.command(
    name="record",
    epilog="""\b
Conditions:
  FIELD == NUMBER, and != < <= > >=     FIELD[2] an element of a vector, FIELD.5 a bit of a number
  FIELD                                 true if it is not zero
  and, or, not, ( )                     runtime_state == running: states may be named by their words

\b
Examples:
  gatewayd rtde record 192.0.2.10                              what people usually want, until Ctrl-C
  gatewayd rtde record 192.0.2.10 run.csv --fields actual_q,actual_TCP_force --frequency 125
  gatewayd rtde record 192.0.2.10 run.csv --config record_configuration.xml --key out
  gatewayd rtde record 192.0.2.10 run.csv --while 'runtime_state == 2' --before 1s --after 2s
  gatewayd rtde record 192.0.2.10 stop.csv --stop 'safety_mode != 1' --after 5s --reconnect
  gatewayd rtde record --gateway press.csv --duration 10min      by the running gateway's connection

\b
Exit codes:
  0  ended by --samples, --duration, a condition or Ctrl-C
  1  the robot was not reached or lost, a field was refused, or the file cannot take more; what it has is whole
  2  wrong usage, a file that exists, a recipe file with mistakes, or no gateway
""",
)
@click.argument("host", required=False)
@click.argument("out", required=False, type=click.Path(dir_okay=False))
@click.option(
    "-f",
    "--fields",
    "names",
    multiple=True,
    metavar="NAME,...",
    help="Record these fields, and the timestamp before them. Repeatable.",
)
@click.option(
    "--config",
    type=click.Path(dir_okay=False),
    help="Record the recipe of this file: XML of the Python client, or text of the C++ client.",
)
@click.option("--key", help="The recipe in --config. [default: the only one, or out]")
@click.option(
    "--frequency",
    type=click.FloatRange(0, 1000),
    default=0.0,
    metavar="HZ",
    help="Packages per second. [default: the controller's own rate]",
)
@click.option(
    "--samples",
    type=click.IntRange(1),
    metavar="N",
    help="End after so many packages, those of --before among them.",
)
@click.option(
    "--duration",
    type=DURATION,
    metavar="TIME",
    help="End after this time: 30s, 10min, 8h; with a condition, from when it held.",
)
@_condition_option("--while", "during", "Record while this holds, each time that it does.")
@click.option("--once", is_flag=True, help="With --while: end when it does not hold any more.")
@_condition_option("--start", "start", "Begin at the first package at which this holds.")
@_condition_option("--stop", "stop", "End with the first package, after the beginning, at which this holds.")
@click.option(
    "--before", type=DURATION, metavar="TIME", help="Record what came this time before a condition, too."
)
@click.option("--after", type=DURATION, metavar="TIME", help="Record for this time after a condition, too.")
@click.option("--binary", is_flag=True, help="Write the official client's binary format: small, exact.")
@delimiter_option(
    "--delimiter", "What separates columns: a character, or space, comma, semicolon, tab.", "space"
)
@click.option(
    "--host-time", is_flag=True, help="Add a last column host_time: when a package came, by this clock."
)
@click.option("--force", is_flag=True, help="Overwrite OUT, and its file of gaps, if it exists.")
@click.option("--reconnect", is_flag=True, help="Wait for the robot, and go on after it was lost.")
@click.option("-q", "--quiet", is_flag=True, help="No progress.")
@click.option(
    "--gateway", is_flag=True, help="Record what a running gateway gets from its robot; leave HOST out."
)
@click.option(
    "--socket",
    type=click.Path(path_type=Path),
    envvar="GATEWAYD_CONTROL",
    help="With --gateway: its control socket. Default: that of the only gateway here.",
)
@cell_option
@click.pass_context
def command(
    context: click.Context,
    host: str | None,
    out: str | None,
    *,
    names: tuple[str, ...],
    config: str | None,
    key: str | None,
    frequency: float,
    samples: int | None,
    duration: float | None,
    during: Condition | None,
    once: bool,
    start: Condition | None,
    stop: Condition | None,
    before: float | None,
    after: float | None,
    binary: bool,
    delimiter: str,
    host_time: bool,
    force: bool,
    reconnect: bool,
    quiet: bool,
    gateway: bool,
    socket: Path | None,
    cell: str | None,
) -> None:
    """Record every package of the robot at HOST in the file OUT, none overtaken, until Ctrl-C.

    OUT is a CSV file as the official client writes and plots it: names in the first line, a line for each package,
    name_0 to name_5 for vectors. Packages that are missing are in OUT.gaps.jsonl, never as odd lines in OUT. However
    it ends, OUT has whole packages only. Without OUT it is named after HOST and the time.

    Nothing is written to the robot and nothing claimed: recording disturbs nobody.
    """
    from gatewayd.cli.rtde.field_choice import USUAL
    from gatewayd.cli.rtde.record_options import (
        conditions_of,
        default_name,
        fields_of,
        target_of,
    )
    from gatewayd.cli.rtde.recorder import RecordingOrder
    from gatewayd.rtde.recording.gaps import SUFFIX

    if gateway and out is None:
        host, out = None, host
    target = target_of(context, host, gateway=gateway, cell=cell, frequency=frequency)
    if binary and typed(context, "delimiter"):
        raise click.UsageError("--delimiter separates the columns of text: leave it out, or --binary")
    conditions = conditions_of(during, start, stop, once=once, before=before, after=after)
    fields = fields_of(names, config, key)
    order = RecordingOrder(
        path=out or default_name(host or cell or "gateway", binary=binary),
        fields=tuple(fields) or (() if gateway else USUAL),
        binary=binary,
        delimiter=delimiter,
        host_time=host_time,
        overwrite=force,
        samples=samples,
        duration=duration,
        trigger=conditions.trigger,
        before=before or 0.0,
        after=after or 0.0,
    )
    # The file itself is created so that none is overwritten in between; this is asked before anybody else is.
    refuse_existing(order.path, f"{order.path}{SUFFIX}", overwrite=force)
    making = (
        partial(_gateway_source, socket, cell, fields, reconnect=reconnect)
        if target is None
        else partial(_robot_source, target, fields, conditions.fields, frequency, reconnect=reconnect)
    )
    context.exit(_run(context, making, order, quiet=quiet))


def _robot_source(
    target: Target, fields: Fields, tested: tuple[str, ...], frequency: float, *, reconnect: bool
) -> PackageSource:
    from gatewayd.cli.rtde.field_choice import USUAL
    from gatewayd.cli.rtde.robot_source import RobotSource
    from gatewayd.rtde.session import TIMESTAMP

    wanted = fields or dict.fromkeys(USUAL)
    subscribed = {**dict.fromkeys((TIMESTAMP, *wanted, *tested)), **wanted}
    return RobotSource(*target, subscribed, frequency=frequency, reconnect=reconnect)


def _gateway_source(
    socket: Path | None, cell: str | None, fields: Fields, *, reconnect: bool
) -> PackageSource:
    from gatewayd.cli.rtde.gateway_source import GatewaySource
    from gatewayd.control.client import Client

    return GatewaySource(Client(socket), cell, fields, reconnect=reconnect)


def _run(
    context: click.Context, making: Callable[[], PackageSource], order: RecordingOrder, *, quiet: bool
) -> int:
    import asyncio

    from gatewayd.cli.rtde.conditions import ConditionError
    from gatewayd.cli.rtde.progress import progress_line
    from gatewayd.cli.rtde.progress_lines import ProgressLines
    from gatewayd.cli.rtde.recording_run import recorded
    from gatewayd.cli.rtde.sources import SourceRefusedError
    from gatewayd.control.client import Client

    async def record(progress: ProgressLines) -> RecordingEnd:
        return await recorded(
            making(), order, lambda tally: progress.show(progress_line(tally)), progress.note
        )

    try:
        with (
            reported(context, remedy="overwrite it with --force"),
            refusals(Client(None), ""),
            ProgressLines(quiet=quiet) as progress,
        ):
            end = asyncio.run(record(progress))
    except ConditionError as error:
        click.echo(printable(f"gatewayd: {error}"), err=True)
        return WRONG
    except SourceRefusedError as error:
        click.echo(printable(f"gatewayd: {error}"), err=True)
        return FAILED
    return _said(end, order)


def _said(end: RecordingEnd, order: RecordingOrder) -> int:
    from gatewayd.cli.rtde.progress import summary
    from gatewayd.rtde.recording.gaps import SUFFIX

    if end.tally is not None:
        click.echo(printable(summary(order.path, end.tally, f"{order.path}{SUFFIX}")))
    if end.failure:
        kept = "; the file has what came until then" if end.tally is not None else ""
        click.echo(printable(f"gatewayd: {end.failure}{kept}"), err=True)
        return FAILED
    if end.tally is None:
        click.echo("gatewayd: ended before the robot was reached; nothing was recorded", err=True)
    return 0
