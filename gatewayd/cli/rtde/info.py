"""`gatewayd rtde info`: what a controller is, how it speaks RTDE, and what it says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gatewayd.cli.rtde.target import TARGET, Target

if TYPE_CHECKING:
    from gatewayd.cli.rtde.info_text import ControllerFacts
    from gatewayd.rtde import Sample

NO_CONTROLLER = 1
"""Exit code."""
_STATES = ("robot_mode", "safety_status", "runtime_state")
_FIRST_SAMPLE = 3.0
_LEAST, _MOST = 0.1, 60.0


@click.command(
    name="info",
    epilog="""\b
Examples:
  gatewayd rtde info 192.0.2.10
  gatewayd rtde info --seconds 10 robot.local     measure the rate for longer
  gatewayd rtde info --json 192.0.2.10 | jq .software

\b
Exit codes:
  0  printed, also where no data came
  1  the controller was not reached, or the connection was lost
  2  wrong usage
""",
)
@click.argument("host", type=TARGET)
@click.option(
    "--seconds",
    type=click.FloatRange(_LEAST, _MOST),
    default=1.0,
    show_default=True,
    help="How long the rate is measured.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document, for programs.")
@click.pass_context
def command(context: click.Context, host: Target, seconds: float, *, as_json: bool) -> None:
    """Print software, series, protocol, measured rate, modes, texts and properties of the controller HOST.

    It connects, reads for a moment and leaves: nothing is claimed or written. Properties (what box and flange it has)
    are answered by software from 5.26 and 10.15 on; older software is silent.
    """
    import asyncio

    from gatewayd.cli.printing import echo
    from gatewayd.cli.rtde.info_text import as_json as document_of
    from gatewayd.cli.rtde.info_text import lines
    from gatewayd.report.printable import printable
    from gatewayd.rtde import RtdeError

    try:
        facts = asyncio.run(look(host, seconds))
    except RtdeError as error:
        click.echo(printable(f"gatewayd: {error}"), err=True)
        context.exit(NO_CONTROLLER)
    if as_json:
        click.echo(document_of(facts), nl=False)
        return
    for line in lines(facts):
        echo(line)


async def look(host: Target, seconds: float) -> ControllerFacts:
    """Connect, and look for so many seconds. Raises RtdeError."""
    import asyncio
    from contextlib import suppress

    from gatewayd import rtde
    from gatewayd.cli.rtde.info_text import ControllerFacts
    from gatewayd.rtde.messages import TextMessage

    async with rtde.connect(
        host[0], port=host[1], outputs=_STATES, strict=False, reconnect=None, buffer=0
    ) as robot:
        loop = asyncio.get_running_loop()
        first = None
        with suppress(TimeoutError):
            first = await robot.newer(_FIRST_SAMPLE)
        begun, packages, skipped = loop.time(), robot.statistics.packages, robot.statistics.skipped
        if first is not None:
            await asyncio.sleep(seconds)
        came, passed = robot.statistics.packages - packages, loop.time() - begun
        properties = await robot.properties()
        texts = (event for event in robot.events.take() if isinstance(event, rtde.TextEvent))
        latest = robot.latest
        return ControllerFacts(
            robot.address,
            str(robot.version),
            robot.series.word if robot.series is not None else None,
            robot.protocol,
            robot.own_address,
            robot.max_frequency,
            robot.frequency,
            came / passed if first is not None else None,
            robot.statistics.skipped - skipped,
            latest.timestamp if latest is not None else None,
            _states(latest) if latest is not None else {},
            [TextMessage(text.message, text.source, text.level) for text in texts],
            properties.answered,
            properties.found,
            properties.missing,
        )


def _states(sample: Sample) -> dict[str, int]:
    """The modes and states that the controller has."""
    found = {name: sample[name] for name in _STATES if name in sample}
    return {name: value for name, value in found.items() if isinstance(value, int)}
