"""What a soak run torments: daemon, simulator, CAN bus and clients as processes."""

from __future__ import annotations

import itertools
import signal
import sys
from contextlib import suppress
from pathlib import Path

from gatewayd.control.client import Client
from tests.e2e.processes import HOST, Daemon, Process, Simulator, free_port, wait_for
from tests.e2e.witness import Witness
from tests.soak.browser import COMPLAINT
from tests.soak.cell import FIELDS, FIELDS_OF, command, journal, mapping
from tests.soak.journal import entries
from tests.soak.look import Look
from tests.soak.starvation import Starvation
from tests.soak.truth import NOT_CONNECTED, Record, misheld, unheard

PATIENCE = 15.0
WRITERS = tuple(FIELDS_OF)
_CLIENTS = (*WRITERS, "poller", "browser")


class Rig:
    """Everything, started and well when constructed; `close` ends it. Logs lie in `directory`."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.modbus, self.can, self.status, self._robot = (free_port() for _ in range(4))
        self._numbers = itertools.count()
        self._everything: list[Process] = []
        self.clients: dict[str, Process] = {}
        self.mapping = directory / "cell.yaml"
        self.audit = directory / "audit.jsonl"
        self.control = Client(directory / "control.sock", patience=2.0)
        self.look = Look(self.control, self.status)
        self.record = Record()
        self.witness = Witness(HOST, self._robot, FIELDS)
        self.starvation = Starvation(self._pids, self.record.stops)
        try:
            self.write_mapping("plain")
            self.simulator = self.start_simulator()
            self.witness.start()
            self.bus = self.start_bus()
            self.daemon = self._start_daemon()
            self.starvation.start()
            for name in _CLIENTS:
                self.start_client(name)
            wait_for(lambda: not self.look.ills() and self.look.page(), "everything to be well", PATIENCE)
        except BaseException:
            self.close()
            raise

    def write_mapping(self, variant: str) -> None:
        self.mapping.write_text(mapping(variant, self._robot, self.modbus, self.can), "utf-8")

    def start_simulator(self, *options: str) -> Simulator:
        """Start it; its predecessor must have been ended by `end_simulator`."""
        self.simulator = Simulator(self._log("simulator"), "--program", "demo", *options, port=self._robot)
        self._everything.append(self.simulator)
        return self.simulator

    def end_simulator(self) -> None:
        self._end(self.simulator)

    def start_bus(self) -> Process:
        """Start it; its predecessor must have been ended by `end_bus`."""
        words = [sys.executable, "-m", "tests.e2e.can_broker", HOST, str(self.can)]
        self.bus = Process(words, self._log("bus"))
        self._everything.append(self.bus)
        said = self.bus.answer()
        assert said == "carrying", said + self.bus.text()
        return self.bus

    def end_bus(self) -> None:
        self._end(self.bus)

    def start_client(self, name: str) -> None:
        self.clients[name] = Process(
            command(name, self.directory, self.modbus, self.can, self.status), self._log(name)
        )
        self._everything.append(self.clients[name])

    def end_client(self, name: str) -> None:
        self._end(self.clients.pop(name))

    def mend(self) -> None:
        """After a fault that stopped half-way: begin the next one with all parts there."""
        self.end_simulator()
        self.start_simulator()
        self.end_bus()
        self.start_bus()
        for name in set(_CLIENTS) - set(self.clients):
            self.start_client(name)

    def complaints(self) -> list[str]:
        """What clients did not like, and how those ended that should not have."""
        ended = [f"{name} has ended" for name, client in self.clients.items() if not client.running]
        return self.clients["browser"].lines(COMPLAINT) + ended

    def lies(self) -> list[str]:
        """What the robot held and should not have, or should have held and did not; the witness stops."""
        self.witness.stop()
        self.starvation.stop()
        found: list[str] = []
        noted = [entry for name in WRITERS for entry in entries(journal(self.directory, name))]
        for field in FIELDS:
            changes = self.witness.changes[field]
            of_field = sorted(entry for entry in noted if entry.field == field)
            found += misheld(field, changes, of_field, self.record)
        stops = sorted(self.record.stops, key=lambda stop: stop.begin)
        lost = sorted(entry.time for entry in noted if entry.outcome == NOT_CONNECTED)
        for name in WRITERS:
            for field in FIELDS_OF[name]:
                mine = [entry for entry in entries(journal(self.directory, name)) if entry.field == field]
                accepted = sorted(
                    entry.time for entry in noted if entry.field == field and entry.outcome == 0
                )
                found += unheard(
                    field,
                    self.witness.changes[field],
                    mine,
                    self.witness.watching,
                    stops,
                    lost=lost,
                    accepted=accepted,
                )
        return found

    def close(self) -> None:
        for watcher in (self.witness, self.starvation):
            if watcher.is_alive():
                watcher.stop()
        for process in self._everything:
            with suppress(ProcessLookupError):
                process.signal(signal.SIGCONT)
            process.kill()

    def _start_daemon(self) -> Daemon:
        places = ("--control", self.control.path, "--audit", self.audit, "--state", self.directory)
        page = ("--status", f"{HOST}:{self.status}")
        daemon = Daemon(self._log("daemon"), self.mapping, *places, *page)
        self._everything.append(daemon)
        return daemon

    def _pids(self) -> list[int]:
        """Of the processes between a writer and the robot."""
        return [process.pid for process in (self.daemon, self.simulator)]

    def _log(self, name: str) -> Path:
        return self.directory / f"{next(self._numbers)}-{name}.log"

    def _end(self, process: Process) -> None:
        process.kill()
        self._everything.remove(process)
