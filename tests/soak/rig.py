"""What a soak run torments: daemon, simulator, two PLCs and a slow poller as processes, and whether they are well."""

from __future__ import annotations

import itertools
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from gatewayd.control.client import Client, ControlError, NoDaemon
from tests.e2e.plant import HEAD
from tests.e2e.plc import HMI, LINE, PLC
from tests.e2e.processes import HOST, Daemon, Process, Simulator, free_port, wait_for
from tests.soak.client import SHARED

__all__ = ["FIRST", "HELD", "PATIENCE", "SECOND", "VARIANTS", "Rig"]

FIRST, SECOND, POLLER = "first", "second", "poller"
PATIENCE = 15.0
HELD = "input_int_register_3"
"""Field that a robot program may hold for itself."""

_CELL = f"""\
writers:
  {FIRST}:  {{modbus: {PLC}, timeout: 1s}}
  {SECOND}: {{modbus: {HMI}, timeout: 1s}}
variables:
  first_in:    {{robot: input_int_register_0, modbus: 0, owner: {FIRST}}}
  second_in:   {{robot: input_int_register_1, modbus: 2, owner: {SECOND}, lease: 500ms}}
  shared:      {{robot: input_int_register_2, modbus: {SHARED}, owner: [{FIRST}, {SECOND}], lease: 300ms}}
  held:        {{robot: {HELD}, modbus: 12}}
  first_echo:  {{robot: output_int_register_0, modbus: 100}}
  second_echo: {{robot: output_int_register_1, modbus: 102}}
  doubles:     {{robot: 'output_double_register_0..23', modbus: 200}}
"""
VARIANTS = {
    "plain": "",
    "another place": "  extra: {robot: output_int_register_0, modbus: 110}\n",
    "another field": "  fresh: {robot: output_int_register_7, modbus: 112}\n",
}
"""Mappings that reloads change between: the same recipe or another one."""
_CLIENTS = {
    FIRST: (PLC, 0, 100, 0.05),
    SECOND: (HMI, 2, 102, 0.08),
    POLLER: (LINE, -1, 0, 1.0),
}


class Rig:
    """Everything, started and well when constructed; `close` ends it. Logs lie in `directory`."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.modbus, self._robot = free_port(), free_port()
        self._numbers = itertools.count()
        self._everything: list[Process] = []
        self.clients: dict[str, Process] = {}
        self.mapping = directory / "cell.yaml"
        self.control = Client(directory / "control.sock", patience=2.0)
        try:
            self.write_mapping("plain")
            self.simulator = self.start_simulator()
            log = self._log("daemon")
            audit = directory / "audit.jsonl"
            self.daemon = Daemon(log, self.mapping, "--control", self.control.path, "--audit", audit)
            self._everything.append(self.daemon)
            for name in _CLIENTS:
                self.start_client(name)
            wait_for(lambda: not self.ills(), "everything to be well", PATIENCE)
        except BaseException:
            self.close()
            raise

    # -- parts ---------------------------------------------------------------------------------------------------------

    def write_mapping(self, variant: str) -> None:
        head = HEAD.format(
            name="cell",
            host=HOST,
            robot=self._robot,
            frequency="0",
            stale_after="300ms",
            robot_options="",
            modbus=self.modbus,
            unit=1,
            modbus_options=", idle_timeout: 3s",
        )
        self.mapping.write_text(head + _CELL + VARIANTS[variant], "utf-8")

    def start_simulator(self, *options: str) -> Simulator:
        """Start it; its predecessor must have been ended by `end_simulator`."""
        self.simulator = Simulator(self._log("simulator"), "--program", "demo", *options, port=self._robot)
        self._everything.append(self.simulator)
        return self.simulator

    def end_simulator(self) -> None:
        self._end(self.simulator)

    def start_client(self, name: str) -> None:
        source, register, echo, pause = _CLIENTS[name]
        arguments = (HOST, source, self.modbus, register, echo, pause)
        command = [sys.executable, "-m", "tests.soak.client", *map(str, arguments)]
        self.clients[name] = Process(command, self._log(name))
        self._everything.append(self.clients[name])

    def end_client(self, name: str) -> None:
        self._end(self.clients.pop(name))

    def close(self) -> None:
        for process in self._everything:
            with suppress(ProcessLookupError):
                process.signal(signal.SIGCONT)
            process.kill()

    # -- how it is -----------------------------------------------------------------------------------------------------

    def ask(self, path: str) -> dict[str, Any] | None:
        """The daemon's answer; None if it gives none."""
        try:
            return self.control.get(path)
        except (NoDaemon, ControlError):
            return None

    def ills(self) -> list[str]:
        """What keeps it all from being well; empty if the daemon says so itself and every PLC is there."""
        status = self.ask("/v1/status")
        if status is None:
            return ["the daemon does not answer"]
        missing = [
            f"writer {writer['name']} is not there"
            for cell in status["cells"]
            for writer in cell["writers"]
            if not writer["alive"]
        ]
        return [*status["problems"], *missing]

    def echoes(self) -> dict[str, Any]:
        """What the PLCs wrote, as it came back from the robot."""
        return {name: value for name, value in self.values().items() if name.endswith("_echo")}

    def values(self) -> dict[str, Any]:
        found = self.ask("/v1/variables")
        return {one["name"]: one["value"] for one in found["variables"]} if found else {}

    def orphans(self) -> list[str]:
        """Locks whose owner is no living writer."""
        status, locks = self.ask("/v1/status"), self.ask("/v1/locks")
        if status is None or locks is None:
            return []
        alive = {writer["name"] for cell in status["cells"] for writer in cell["writers"] if writer["alive"]}
        # In this order a lock taken between the two answers may look orphaned; the second look tells.
        return [
            one["name"] for one in locks["locks"] if one["owner"] is not None and one["owner"] not in alive
        ]

    def locks_of(self, owner: str) -> list[str]:
        found = self.ask("/v1/locks")
        return [one["name"] for one in found["locks"] if one["owner"] == owner] if found else [owner]

    def descriptors(self) -> int:
        return sum(1 for _ in Path(f"/proc/{self.daemon.pid}/fd").iterdir())

    # -- own parts -----------------------------------------------------------------------------------------------------

    def _log(self, name: str) -> Path:
        return self.directory / f"{next(self._numbers)}-{name}.log"

    def _end(self, process: Process) -> None:
        process.kill()
        self._everything.remove(process)
