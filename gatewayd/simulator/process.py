"""The simulator as a process of its own: signals, the line with the port, commands from standard input."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import stat
import sys
from collections.abc import Awaitable, Callable, Mapping

from gatewayd.report.format import address
from gatewayd.simulator.control import RobotControls
from gatewayd.simulator.server import SimulatedController

_LONGEST_LINE = 65536


async def serve(simulators: Mapping[str, SimulatedController], *, control: bool) -> None:
    """Run until SIGTERM, SIGINT, SIGHUP or, with `control`, `quit` or the end of standard input.

    Prints `listening on HOST:PORT` once connections are accepted, for each of several robots `NAME: listening on
    HOST:PORT`, and `dashboard on HOST:PORT` likewise where it has a dashboard server. Ends as well when what drives the
    robots has come to its end. OSError if an address cannot be had.
    """
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        loop.add_signal_handler(number, stop.set)
    async with contextlib.AsyncExitStack() as stack:
        for simulator in simulators.values():
            simulator.ended = stop.set
            await stack.enter_async_context(simulator)
        reader = asyncio.create_task(_commands(RobotControls(simulators), stop)) if control else None
        for name, simulator in simulators.items():
            prefix = f"{name}: " if len(simulators) > 1 else ""
            _say(f"{prefix}listening on {address(simulator.host, simulator.port)}", stop)
            if simulator.dashboard is not None:
                _say(f"{prefix}dashboard on {address(simulator.host, simulator.dashboard.port)}", stop)
        await stop.wait()
        if reader is not None:
            reader.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await reader


async def _commands(control: RobotControls, stop: asyncio.Event) -> None:
    """Answer each line of standard input with one line."""
    readline = await _standard_input()
    while not control.quit:
        line = await readline()
        if not line:
            break
        if line.strip():
            _say(await control.execute(line.decode("utf-8", "replace")), stop)
    stop.set()


async def _standard_input() -> Callable[[], Awaitable[bytes]]:
    """How to read the next line; b"" at the end."""
    loop = asyncio.get_running_loop()
    mode = os.fstat(sys.stdin.fileno()).st_mode
    if not (stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode) or sys.stdin.isatty()):
        # A file is never waited for, and cannot be: epoll refuses it.
        return lambda: loop.run_in_executor(None, sys.stdin.buffer.readline)
    lines = asyncio.StreamReader(limit=_LONGEST_LINE)
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(lines), sys.stdin.buffer)

    async def readline() -> bytes:
        try:
            return await lines.readline()
        except ValueError:  # longer than the limit; asyncio has dropped what it had of it
            return b"?\n"

    return readline


def _say(line: str, stop: asyncio.Event) -> None:
    """One line to the process that started us; nobody reading any more means to stop."""
    try:
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        stop.set()
