"""`gatewayd trace`: what passes the links of the running gateway, in words or as files for other tools."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from gatewayd.cli.remote import DURATION, UNREACHABLE, cell_option, on_gateway
from gatewayd.report.format import counted
from gatewayd.report.printable import json_text, printable

if TYPE_CHECKING:
    from gatewayd.control.client import Client
    from gatewayd.links.contract import TrafficDecoder

Row = Mapping[str, Any]
_Form = Callable[[Row], bytes]


@click.command(
    name="trace",
    epilog="""\b
Examples:
  gatewayd trace                            everything, until Ctrl-C
  gatewayd trace --link modbus --peer 192.0.2.20
  gatewayd trace --link canopen --format candump -o bus.log
  gatewayd trace --seconds 60s --format pcap -o cell.pcapng
  gatewayd trace --format pcap | wireshark -k -i -

\b
Exit codes:
  0  printed, ended by --seconds or --count
  1  refused
  2  wrong usage, no gateway could be reached, or the gateway has ended
""",
)
@on_gateway
@cell_option
@click.option("--link", metavar="NAME", help="Only this link, by its name or kind: modbus, canopen, robot.")
@click.option("--peer", metavar="ADDRESS", help="Only this peer, with or without its port.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "candump", "pcap"]),
    default="text",
    show_default=True,
    help="Decoded text; JSON, one object per line; the log format of candump (CAN only); pcapng for Wireshark.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(dir_okay=False),
    help="Write to FILE, not to standard output.",
)
@click.option("--seconds", "duration", metavar="TIME", type=DURATION, help="End after this time: 30s, 5min.")
@click.option(
    "--count",
    type=click.IntRange(1, 10**9 - 1),
    help="End after this many requests, frames or messages.",
)
@click.pass_context
def command(
    context: click.Context,
    client: Client,
    cell: str | None,
    *,
    link: str | None,
    peer: str | None,
    form: str,
    output: str | None,
    duration: float | None,
    count: int | None,
) -> None:
    """Print the traffic on the links of the running gateway: Modbus requests and answers, CAN frames, RTDE messages."""
    if form == "pcap" and output is None and sys.stdout.isatty():
        raise click.UsageError("pcap is for a file or a pipe: name a file with -o")
    seconds = None if duration is None else max(1, round(duration))
    found = client.follow("/v1/trace", cell=cell, link=link, peer=peer, seconds=seconds, count=count)
    ended = False
    with _opened(output) as file:
        for data in _written(found, _FORMS[form]()):
            ended = ended or data is None
            file.write(data or b"")
            file.flush()
    if not ended:
        click.echo("the gateway has ended", err=True)
        context.exit(UNREACHABLE)


def _written(found: Iterable[Row], form: _Form) -> Iterator[bytes | None]:
    """What is to be written of each row; None at the end of the trace. What was dropped is said on stderr."""
    for row in found:
        if "passed" in row:
            lost = f", {row['dropped']} dropped" if row["dropped"] else ""
            click.echo(f"{counted(row['passed'], 'entry')}{lost}", err=True)
            yield None
        elif "dropped" in row:
            click.echo(f"{row['dropped']} dropped so far: narrow the trace by --link or --peer", err=True)
        else:
            yield form(row)


def _opened(output: str | None) -> AbstractContextManager[IO[bytes]]:
    if output is None:
        return nullcontext(sys.stdout.buffer)
    try:
        return Path(output).open("wb")
    except OSError as error:
        raise click.FileError(output, error.strerror or "") from error


def _words() -> Callable[[Row], str]:
    """Puts rows into words, with a decoder for each link."""
    from gatewayd.links.registry import decoder_of

    decoders: dict[tuple[str, str], TrafficDecoder] = {}

    def words(row: Row) -> str:
        link = row["link"], row["kind"]
        if link not in decoders:
            decoders[link] = decoder_of(row["kind"])
        return decoders[link].words(
            bytes.fromhex(row["data"]), row["peer"] or row["own"], outgoing=row["out"]
        )

    return words


def _text() -> _Form:
    from datetime import UTC, datetime

    words = _words()

    def line(row: Row) -> bytes:
        moment = datetime.fromtimestamp(row["time"], UTC)
        arrow = "->" if row["out"] else "<-"
        text = f"{row['cell'] or '-'} {row['link']} {arrow} {row['peer'] or row['own']}  {words(row)}"
        return f"{moment:%H:%M:%S.%f}Z {printable(text)}\n".encode()

    return line


def _json() -> _Form:
    words = _words()
    return lambda row: (
        json_text(json.dumps({**row, "text": words(row)}, ensure_ascii=False)) + "\n"
    ).encode()


def _candump() -> _Form:
    from gatewayd.cli.capture import candump_line

    def line(row: Row) -> bytes:
        found = candump_line(_captured(row))
        return f"{found}\n".encode() if found else b""

    return line


def _pcap() -> _Form:
    from gatewayd.cli.capture import PcapWriter

    writer = PcapWriter()
    return lambda row: writer.blocks(_captured(row))


@cache
def _carrier(kind: str) -> TrafficDecoder:
    """For its medium and port, which are those of all links of the kind."""
    from gatewayd.links.registry import decoder_of

    return decoder_of(kind)


def _captured(row: Row) -> Any:
    from gatewayd.cli.capture import Captured

    kind = _carrier(row["kind"])
    return Captured(
        row["time"], kind.medium, kind.port, row["peer"], row["own"], row["out"], bytes.fromhex(row["data"])
    )


_FORMS: Mapping[str, Callable[[], _Form]] = {
    "text": _text,
    "json": _json,
    "candump": _candump,
    "pcap": _pcap,
}
