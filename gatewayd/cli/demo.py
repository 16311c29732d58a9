"""`gatewayd demo`: simulator, gateway, a small PLC program, an I/O island and a CANopen master in one terminal."""

from __future__ import annotations

import asyncio
import errno
import math
import os
import shlex
import signal
import sys
from pathlib import Path
from shutil import which
from typing import TYPE_CHECKING

import click

from gatewayd.loop import clock

if TYPE_CHECKING:
    from rich.console import Console

    from gatewayd.demo.scene import Scene

UNATTENDED = 20.0
"""Seconds a demonstration lasts that nobody can see or end, because stdout is no terminal."""
FRAME = 0.25
"""Seconds between two pictures of the live table."""
BLOCK = 1.0
"""Seconds between two blocks of plain lines."""
FAILED = 1
FORCED = 130


@click.command(
    name="demo",
    epilog="""\b
Examples:
  gatewayd demo               until Ctrl-C
  gatewayd demo --seconds 10  for 10 s
  gatewayd demo | head -40    plain lines, one block a second

\b
Exit codes:
  0    parts were made, and every value came back right on both buses (or Ctrl-C before the first time)
  1    that was not the case, or the port is taken
  130  forced by a second Ctrl-C
""",
)
@click.option(
    "--seconds",
    type=click.FloatRange(0),
    metavar="N",
    help="End after N seconds; 0: at Ctrl-C. Default: 0, or 20 where the output is not a terminal.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="Modbus TCP port; 0 takes a free one. Default: 1502 if it is free, else a free one.",
)
def command(seconds: float | None, port: int | None) -> int:
    """See it work: a simulated robot, the gateway, a small PLC program, an I/O island and a CANopen master.

    No robot is needed. They talk to each other over real sockets and a CAN bus inside this process. The table shows
    what the gateway knows: every variable with its registers, objects, value, quality, age and owner. From another
    terminal you can take part.
    """
    from rich.console import Console

    console = Console(highlight=False)
    live = console.is_terminal and not console.is_dumb_terminal
    if seconds is None and not live:
        seconds = UNATTENDED
    try:
        chosen, note = _port(port)
    except OSError as error:
        reason = error.strerror or str(error)
        click.echo(f"gatewayd: cannot listen on port {port}: {reason}; --port 0 takes a free one", err=True)
        return FAILED
    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        return runner.run(_play(console, chosen, note, seconds or None, live=live))


def _port(wanted: int | None) -> tuple[int, str]:
    """The port, and what there is to say about it. OSError if the one asked for cannot be had."""
    from gatewayd.demo.scene import HOST, PORT, free_port

    if wanted is not None:
        return free_port(HOST, wanted), ""
    try:
        return free_port(HOST, PORT), ""
    except OSError as error:
        if error.errno != errno.EADDRINUSE:
            raise
        return free_port(HOST), f"\nport {PORT} is taken by another program"


async def _play(console: Console, port: int, note: str, seconds: float | None, *, live: bool) -> int:
    from gatewayd.demo.scene import HOST, PLC_ADDRESS, Scene
    from gatewayd.demo.summary import summary

    stop = asyncio.Event()
    _stop_on_signals(stop, console)
    scene = Scene(port)
    scene.listen_to_logs()
    async with scene.playing():
        console.print(
            f"[bold]gatewayd demo[/]: robot on port {scene.robot.port}, "
            f"Modbus TCP [bold]{HOST}:{port}[/], PLC {PLC_ADDRESS}{note}",
            soft_wrap=not live,
        )
        if live:
            await _live(console, scene, stop, seconds)
        else:
            await _lines(scene, stop, seconds)
        passed, text = summary(scene, asked_for=seconds is not None)
    console.print(f"\n{text}", soft_wrap=not live)
    return 0 if passed else FAILED


def _stop_on_signals(stop: asyncio.Event, console: Console) -> None:
    def on_signal() -> None:
        if stop.is_set():
            console.show_cursor()
            os._exit(FORCED)
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, on_signal)
    # A terminal that is closed says so twice, by the shell and by the system: that is no second Ctrl-C.
    asyncio.get_running_loop().add_signal_handler(signal.SIGHUP, stop.set)


async def _live(console: Console, scene: Scene, stop: asyncio.Event, seconds: float | None) -> None:
    """A picture four times a second, in place."""
    from rich.live import Live

    from gatewayd.demo.snapshot import snapshot
    from gatewayd.demo.view import commands, screen

    pokes, without_mbpoll = commands(scene.port, _python())
    if which("mbpoll") is None:
        console.print(f"[dim]{without_mbpoll[0]}:[/] {without_mbpoll[1]}", soft_wrap=True)
    before = None
    with Live(console=console, auto_refresh=False, vertical_overflow="crop") as picture:
        while not stop.is_set():
            shot = snapshot(scene, clock.now())
            picture.update(screen(shot, before, pokes, *console.size), refresh=True)
            before = shot
            if await _wait(scene, stop, FRAME, seconds):
                break


async def _lines(scene: Scene, stop: asyncio.Event, seconds: float | None) -> None:
    """A block of lines every second."""
    from gatewayd.demo.snapshot import snapshot
    from gatewayd.demo.view import commands, plain

    pokes, without_mbpoll = commands(scene.port, _python())
    for meaning, text in [*pokes, without_mbpoll]:
        click.echo(f"{meaning}: {text}")
    while not await _wait(scene, stop, BLOCK, seconds):
        click.echo(plain(snapshot(scene, clock.now())))
    click.echo(plain(snapshot(scene, clock.now())))


async def _wait(scene: Scene, stop: asyncio.Event, pause: float, seconds: float | None) -> bool:
    """Wait for `pause`; returns whether the end has come."""
    left = scene.started + seconds - clock.now() if seconds is not None else math.inf
    try:
        async with asyncio.timeout(max(0.0, min(pause, left))):
            await stop.wait()
    except TimeoutError:
        return left <= pause
    return True


def _python() -> str:
    """The name of this interpreter, as short as it can be typed here."""
    path = Path(sys.executable)
    here = Path.cwd()
    return shlex.quote(str(path.relative_to(here) if path.is_relative_to(here) else path))
