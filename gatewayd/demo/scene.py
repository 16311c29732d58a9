"""Everything that `gatewayd demo` runs: a simulated robot, the gateway, a PLC, an I/O island and a CANopen master."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

from gatewayd.core.cell import Cell
from gatewayd.demo.island import Island
from gatewayd.demo.master import Master
from gatewayd.demo.plc import FORCE_SHARE, Plc
from gatewayd.loop import clock
from gatewayd.mapping.loader import Loaded, load
from gatewayd.report.layout import Row
from gatewayd.report.table import rows
from gatewayd.service.daemon import Daemon
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.program import parse
from gatewayd.simulator.server import SimulatedController

HOST = "127.0.0.1"
PORT = 1502
"""The gateway's port, if it is free."""
ROBOT_PORT = 30004
ISLAND_PORT = 1503
PLC_ADDRESS = "127.0.0.2"
"""Where the PLC's connection comes from, so that the gateway can tell it from whatever else this machine starts."""
MAPPING = "demo.yaml"
CHANNEL = "gatewayd-demo"
"""The bus inside this process, as the mapping names it."""
LINE = "line"
"""The writer that the CANopen master is."""

ROBOT_PROGRAM = f"""\
output_bit_register_0 = input_bit_register_0 for 400ms        # busy
output_bit_register_1 = input_bit_register_0 after 400ms      # done
output_bit_register_2 = input_bit_register_0 for 450ms        # the clamp
output_int_register_0 = input_int_register_0 after 300ms      # the part made
output_int_register_1 = count input_bit_register_0            # cycles
output_double_register_0 = input_double_register_0 * {FORCE_SHARE} after 200ms
output_double_register_1 = input_double_register_1 after 200ms
output_double_register_2 = input_double_register_2 after 200ms
"""
_FULL_SPEED = 100.0
_PROBLEMS = 4


def mapping(robot_port: int = ROBOT_PORT, port: int = PORT, island_port: int = ISLAND_PORT) -> Loaded:
    """The mapping of the demonstration, with its robot, its Modbus server and its island at these ports."""
    text = files(__package__).joinpath(MAPPING).read_text()
    text = text.replace(f"host: {HOST}\n", f"host: {HOST}\n  port: {robot_port}\n")
    text = text.replace(f"modbus: '{HOST}:{ISLAND_PORT}'", f"modbus: '{HOST}:{island_port}'")
    return load(text.replace(f"listen: {HOST}:{PORT}", f"listen: {HOST}:{port}").encode(), MAPPING)


class Scene:
    """The five parties and what can be seen of them. `port` 0 takes a free one."""

    def __init__(self, port: int) -> None:
        loaded = mapping()
        assert loaded.plan is not None
        self.rows: tuple[Row, ...] = rows(loaded.cell)
        self.port = port or free_port(HOST)
        self.started = clock.now()
        self.problems: deque[str] = deque(maxlen=_PROBLEMS)
        """Errors that the parties have logged, which no demonstration should have."""
        self.robot = SimulatedController(Controller(program=parse(ROBOT_PROGRAM, "robot program")), host=HOST)
        self.robot.set("input_double_register_1", _FULL_SPEED)
        self.plc = Plc(HOST, self.port, PLC_ADDRESS)
        self.master = Master(CHANNEL)
        self._island_port = free_port(HOST)
        self.island = Island(HOST, self._island_port)
        self.can_writer = [writer.name for writer in loaded.plan.cell.writers].index(LINE)
        """Index of the writer that the master is."""
        self._daemon: Daemon | None = None
        self._state = TemporaryDirectory(prefix="gatewayd-demo-")

    @property
    def cell(self) -> Cell:
        """The gateway's cell."""
        assert self._daemon is not None
        return self._daemon.runtimes[0].cell

    @asynccontextmanager
    async def playing(self) -> AsyncIterator[None]:
        """Everything runs inside the block. What follows it sees the parties as they ended."""
        stop = asyncio.Event()
        async with self.robot:
            plan = mapping(self.robot.port, self.port, self._island_port).plan
            assert plan is not None
            self._daemon = Daemon([plan], Path(self._state.name))
            others = [asyncio.create_task(self.master.run()), asyncio.create_task(self.island.run())]
            gateway = asyncio.create_task(self._daemon.run(stop))
            plc = asyncio.create_task(self.plc.run())
            try:
                yield
            finally:
                self.plc.stop()
                plc.cancel()
                with suppress(asyncio.CancelledError):
                    await plc
                stop.set()
                await gateway
                for other in others:
                    other.cancel()
                    with suppress(asyncio.CancelledError):
                        await other

    def listen_to_logs(self) -> None:
        """Keep the log off the screen; errors go to `problems`."""
        logging.getLogger().handlers[:] = [_Collector(self.problems)]


class _Collector(logging.Handler):
    """Keeps the texts of errors."""

    def __init__(self, problems: deque[str]) -> None:
        super().__init__(logging.ERROR)
        self._problems = problems

    def emit(self, record: logging.LogRecord) -> None:
        self._problems.append(record.getMessage())


def free_port(host: str, wanted: int = 0) -> int:
    """`wanted` if it can be listened on, or any free port for 0. OSError if it cannot be had."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, wanted))
        port: int = probe.getsockname()[1]
        return port
