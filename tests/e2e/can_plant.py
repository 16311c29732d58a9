"""What a plant has more with CANopen: a bus between processes, and a master on it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Process, free_port, wait_for

NODE = 16


class Master:
    """The master process; each command is a method of `can_master.Master`."""

    def __init__(self, process: Process) -> None:
        self.process = process
        said = process.answer()
        assert said == "master", said + process.text()
        self._emergencies: list[tuple[int, int, str]] = []

    def ask(self, command: str, *arguments: Any) -> Any:
        """Carry out a command; its result."""
        assert self.process.popen.stdin is not None
        self.process.popen.stdin.write(json.dumps([command, *arguments]) + "\n")
        answer = self.process.answer()
        assert answer, f"{command}: {self.process.text()}"
        return json.loads(answer)

    @property
    def state(self) -> int:
        """The last NMT state that was heard."""
        return int(self.ask("heard")["state"])

    def becomes(self, state: int) -> float:
        return wait_for(lambda: self.state == state, f"NMT state {state}")

    def output(self, key: str) -> Any:
        """A mapped object as its TPDO sent it last."""
        return self.ask("outputs")["values"][key]

    def emergency(self, code: int) -> tuple[int, int, str]:
        """Wait for an EMCY of this code; it and those before it are forgotten."""

        def came() -> bool:
            self._emergencies += [tuple(one) for one in self.ask("emergencies")]
            return any(one[0] == code for one in self._emergencies)

        wait_for(came, f"EMCY {code:04X}h")
        position = next(number for number, one in enumerate(self._emergencies) if one[0] == code)
        found = self._emergencies[position]
        del self._emergencies[: position + 1]
        return found


def start_bus(plant: Plant, port: int | None = None) -> tuple[Process, int]:
    """A bus between processes, and its port."""
    port = free_port() if port is None else port
    broker = plant.start("can_broker", HOST, port)
    said = broker.answer()
    assert said == "carrying", said + broker.text()
    return broker, port


def start_master(plant: Plant, mapping: Path, interface: str, channel: str) -> Master:
    """A master that has the data sheet of the gateway, on its bus."""
    sheet = mapping.with_suffix(".eds")
    export = [sys.executable, "-m", "gatewayd", "export", "eds", str(mapping), "-o", str(sheet)]
    subprocess.run(export, check=True, capture_output=True)
    return Master(plant.start("can_master", interface, channel, str(sheet), NODE))
