"""`gatewayd rtde message`: a line in a controller's log."""

from __future__ import annotations

import click

from gatewayd.cli.rtde.target import TARGET, Target

_LEVELS = ("info", "warning", "error", "exception")


@click.command(
    name="message",
    epilog="""\b
Examples:
  gatewayd rtde message 192.0.2.10 'gripper changed by anna'
  gatewayd rtde message 192.0.2.10 'test run 7 begins' --level warning --source 'line 3'

\b
Exit codes:
  0  sent: RTDE confirms no text
  1  the robot was not reached
  2  wrong usage
""",
)
@click.argument("host", type=TARGET)
@click.argument("text")
@click.option(
    "--level", type=click.Choice(_LEVELS), default=_LEVELS[0], show_default=True, help="How grave it is."
)
@click.option("--source", default="gatewayd", show_default=True, help="Who says it.")
@click.option("--confirm-exception", is_flag=True, help="Send level exception: see above.")
def command(host: Target, text: str, *, level: str, source: str, confirm_exception: bool) -> None:
    """Put a line with TEXT, 255 bytes at most, into the log of the controller at HOST.

    Level exception is more than a line: it tells the controller that the sending program has failed and cannot go on,
    and what the controller makes of that is its own affair. It is sent only with --confirm-exception.
    """
    import asyncio

    from gatewayd.cli.rtde.robots import failures

    if level == "exception" and not confirm_exception:
        raise click.UsageError(
            "level exception says that the sending program has failed without a way back: "
            "choose --level error, or add --confirm-exception if that is meant"
        )
    if not text.strip():
        raise click.UsageError("the text is empty")
    with failures():
        try:
            asyncio.run(_send(host, text, level, source))
        except ValueError as error:
            raise click.UsageError(str(error)) from error
    click.echo(f"sent at level {level}")


async def _send(host: Target, text: str, level: str, source: str) -> None:
    from gatewayd import rtde

    async with rtde.connect(host[0], port=host[1], start=False, reconnect=None) as robot:
        await robot.message(text, level=rtde.TextLevel[level.upper()], source=source)
