"""A plant: simulator, daemon and PLCs as real processes and connections, and the mapping that ties them together."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, free_port, wait_for

_Process = TypeVar("_Process", bound=Process)

HEAD = """\
gatewayd: 1
cell: {name}
robot: {{host: {host}, port: {robot}, frequency: {frequency}, stale_after: {stale_after}{robot_options}}}
modbus: {{listen: '{host}:{modbus}', unit: {unit}{modbus_options}}}
"""


class Plant:
    """What a test starts; `stop` ends it all and shows every log (pytest prints it for a red test)."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.modbus = free_port()
        self._processes: list[Process] = []
        self._clients: list[Plc] = []

    def _log(self, name: str) -> Path:
        return self.directory / f"{len(self._processes)}-{name}.log"

    def simulator(self, *options: str, port: int = 0, frequency: float = 125) -> Simulator:
        """A controller; without options it echoes every reserved register."""
        simulator = Simulator(
            self._log("simulator"), *(options or ("--program", "demo")), port=port, frequency=frequency
        )
        self._processes.append(simulator)
        return simulator

    def mapping(
        self,
        text: str,
        robot: int,
        *,
        name: str = "cell",
        unit: int = 1,
        modbus: int | None = None,
        frequency: float = 0,
        stale_after: str = "600ms",
        robot_options: str = "",
        modbus_options: str = "",
    ) -> Path:
        """Write a mapping file: the head for these ports, then `text` (writers, groups, variables)."""
        head = HEAD.format(
            name=name,
            host=HOST,
            robot=robot,
            frequency=f"{frequency:g}",
            stale_after=stale_after,
            robot_options=robot_options,
            modbus=self.modbus if modbus is None else modbus,
            unit=unit,
            modbus_options=modbus_options,
        )
        path = self.directory / f"{name}.yaml"
        path.write_text(head + text, "utf-8")
        return path

    def run(self, *arguments: str | Path) -> Daemon:
        """`gatewayd run`, not waited for."""
        daemon = Daemon(self._log("daemon"), *arguments)
        self._processes.append(daemon)
        return daemon

    def daemon(self, *arguments: str | Path) -> Daemon:
        """`gatewayd run`, listening."""
        daemon = self.run(*arguments)
        wait_for(
            lambda: not daemon.running or bool(daemon.lines("listening for Modbus")), "the daemon to listen"
        )
        assert daemon.running, daemon.text()
        return daemon

    def plc(self, source: str = PLC, unit: int = 1) -> Plc:
        """A Modbus client."""
        plc = Plc(self.modbus, source, unit)
        self._clients.append(plc)
        return plc

    def ready_plc(self, source: str = PLC, unit: int = 1) -> Plc:
        """A Modbus client, when the robot is fresh and can be written."""
        plc = self.plc(source, unit)
        wait_for(lambda: plc.writable, "the robot to be writable")
        return plc

    def start(self, module: str, *arguments: str | int) -> Process:
        """Another program: a module of this directory."""
        return self.program([sys.executable, "-m", f"tests.e2e.{module}", *map(str, arguments)], module)

    def program(self, command: Sequence[str], name: str) -> Process:
        """Any other program."""
        process = Process(command, self._log(name))
        self._processes.append(process)
        return process

    def add(self, process: _Process) -> _Process:
        """One that the test has started itself: it ends with the plant."""
        self._processes.append(process)
        return process

    def stop(self) -> None:
        for client in self._clients:
            client.close()
        for process in self._processes:
            ended = process.popen.poll()
            process.kill()
            print(f"--- {process.log.name}: {process.popen.args!r} ended={ended}\n{process.text()[-8000:]}")
