"""`gatewayd devices scan`: which units or nodes answer on a line."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

import click

from gatewayd.cli.remote import DURATION, RemoteError, echo_json
from gatewayd.report.printable import printable

if TYPE_CHECKING:
    from pathlib import Path

    from gatewayd.links.access import DeviceAccess, FoundDevice, Scan, ScanOrder

FOUND, NOBODY, UNUSABLE = 0, 1, 2
"""Exit codes."""
_NUMBERS = re.compile(r"([0-9]{1,3})(?:\.\.([0-9]{1,3}))?")


class LineUnusable(RemoteError):
    """The line cannot be opened."""

    exit_code = UNUSABLE


@click.command(
    name="scan",
    epilog="""\b
Examples:
  gatewayd devices scan 127.0.0.1:502                                Modbus TCP: units 1 to 247
  gatewayd devices scan 127.0.0.1:502 --numbers 1..10                a few of them
  gatewayd devices scan 127.0.0.1:4001 --framing rtu                 a serial line behind a converter
  gatewayd devices scan /dev/ttyUSB0 --baudrate 115200               Modbus RTU, 8N1
  gatewayd devices scan /dev/ttyUSB0 --parity even --timeout 500ms   slow units
  gatewayd devices scan can0                                         CANopen: nodes 1 to 127

\b
Exit codes:
  0  somebody answers
  1  nobody answers, or a running gateway has the line
  2  wrong usage, or the line cannot be opened
""",
)
@click.argument("line")
@click.option(
    "--numbers", metavar="FIRST..LAST", help="Units or nodes to ask. Default: units 1..247, or nodes 1..127."
)
@click.option(
    "--timeout",
    type=DURATION,
    metavar="TIME",
    help="How long each may take to answer. Default: 200ms for a unit, 500ms for a node.",
)
@click.option("--baudrate", type=click.IntRange(300, 4_000_000), help="Of a serial port. Default: 19200.")
@click.option("--parity", type=click.Choice(["none", "even", "odd"]), help="Of a serial port. Default: none.")
@click.option("--stop-bits", type=click.IntRange(1, 2), help="Of a serial port. Default: 1.")
@click.option(
    "--framing", type=click.Choice(["tcp", "rtu"]), help="By TCP: frames of Modbus TCP, or of a serial line."
)
@click.option("--interface", metavar="NAME", help="Of python-can, for a CAN bus. Default: socketcan.")
@click.option(
    "--bitrate",
    type=click.IntRange(10_000, 1_000_000),
    help="Of a CAN bus by --interface; the kernel's are set up already. Default: 500000.",
)
@click.option("--json", "as_json", is_flag=True, help="Print who was found as JSON, at the end.")
@click.pass_context
def command(
    context: click.Context,
    line: str,
    *,
    numbers: str | None,
    timeout: float | None,
    baudrate: int | None,
    parity: str | None,
    stop_bits: int | None,
    framing: str | None,
    interface: str | None,
    bitrate: int | None,
    as_json: bool,
) -> None:
    """Ask on LINE who is there, one number after the other. It only reads, and needs no gateway.

    LINE is host:port (Modbus TCP), a serial port like /dev/ttyUSB0 (Modbus RTU), or can0 (CANopen).

    A unit is asked for holding register 0, and for its identification (function 43) where it has one; a node for its
    device type (1000h) and its identity (1018h). A serial port that a running gateway has, and a CAN bus that it
    manages, are not scanned: two masters disturb each other. Whether another master is on the line nobody can know.
    """
    from gatewayd.links.access import ScanOrder

    first, last = _range(numbers)
    settings: dict[str, object] = {
        "baudrate": baudrate,
        "parity": parity,
        "stop_bits": stop_bits,
        "framing": framing,
    }
    settings |= {"interface": interface, "bitrate": bitrate}
    order = ScanOrder(line, first, last, timeout, settings)
    found = _scanned(order, context.parent.params.get("socket") if context.parent else None, quiet=as_json)
    if as_json:
        echo_json([{"number": each.number, "text": each.text, **each.fields} for each in found])
    context.exit(FOUND if found else NOBODY)


def _range(text: str | None) -> tuple[int | None, int | None]:
    if text is None:
        return None, None
    match = _NUMBERS.fullmatch(text)
    if match is None:
        raise click.BadParameter(f"{text!r} is no range: write 1..10, or 5", param_hint="--numbers")
    return int(match[1]), int(match[2] or match[1])


def _scanned(order: ScanOrder, socket: Path | None, *, quiet: bool) -> list[FoundDevice]:
    import asyncio

    from gatewayd.cli.devices.asking import running_cells
    from gatewayd.links.access import AccessError, AccessProblem

    try:
        scan = _access().scan(order)
        running = running_cells(socket)
        refusal = scan.refusal(running)
        if refusal:
            raise RemoteError(f"{scan.line} is not scanned: {refusal}")
        for remark in scan.remarks(running):
            click.echo(printable(remark), err=True)
        return asyncio.run(_run(scan, quiet=quiet))
    except AccessError as error:
        if error.problem is AccessProblem.BAD_PLACE:
            raise click.UsageError(printable(str(error))) from error
        raise LineUnusable(error) from error


def _access() -> DeviceAccess:
    """What knows lines. There is one kind of devices."""
    from gatewayd.links.registry import access_of, kinds

    (found,) = filter(None, (access_of(kind.key) for kind in kinds()))
    return found


async def _run(scan: Scan, *, quiet: bool) -> list[FoundDevice]:
    count, noun = len(scan.numbers), scan.noun
    click.echo(
        printable(
            f"{scan.line}: asking {noun}s {scan.numbers[0]}..{scan.numbers[-1]} for {scan.asked}, "
            f"{scan.longest:.0f} s at most; nothing is written"
        ),
        err=True,
    )
    found: list[FoundDevice] = []
    counting = sys.stderr.isatty()
    async for news in scan.run():
        if isinstance(news, int):
            if counting:
                click.echo(f"\r{news} of {count}", nl=False, err=True)
            continue
        found.append(news)
        if not quiet:
            if counting:
                click.echo("\r", nl=False, err=True)
            click.echo(printable(f"{noun} {news.number}: {news.text or 'answers, says nothing of itself'}"))
    if counting:
        click.echo("\r" + " " * 20 + "\r", nl=False, err=True)
    if not found:
        click.echo(
            f"nobody answers: power, cable, and how the line is set up ({printable(scan.line)})", err=True
        )
    return found
