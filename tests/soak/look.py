"""How the daemon of a soak run is, as it says itself over the control socket and as the kernel sees it."""

from __future__ import annotations

import json
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import Any

from gatewayd.control.client import Client, ControlError, NoDaemon
from tests.e2e.processes import HOST

_TIMEOUT = 2.0


class Look:
    """Questions to one daemon."""

    def __init__(self, control: Client, status: int) -> None:
        self._control = control
        self._status = status

    def ask(self, path: str) -> dict[str, Any] | None:
        """The daemon's answer; None if it gives none."""
        try:
            return self._control.get(path)
        except (NoDaemon, ControlError):
            return None

    def ills(self) -> list[str]:
        """What keeps it all from being well; empty if the daemon says so itself and every writer is there."""
        status = self.ask("/v1/status")
        if status is None:
            return ["the daemon does not answer"]
        missing = [
            f"writer {writer['name']} is not there"
            for cell in status["cells"]
            for writer in cell["writers"]
            if not writer["alive"]
        ]
        idle = [
            f"the node is {cell['canopen']['nmt_state']}"
            for cell in status["cells"]
            if cell["canopen"]["nmt_state"] != "operational"
        ]
        return [*status["problems"], *missing, *idle]

    def page(self) -> bool:
        """Whether the status listener answers."""
        connection = HTTPConnection(HOST, self._status, timeout=_TIMEOUT)
        try:
            connection.request("GET", "/readyz")
            return connection.getresponse().status == 200
        except (OSError, HTTPException):
            return False
        finally:
            connection.close()

    def echoes(self) -> dict[str, Any]:
        """What the writers wrote, as it came back from the robot."""
        return {name: value for name, value in self.values().items() if name.endswith("_echo")}

    def values(self) -> dict[str, Any]:
        return {variable["name"]: variable["value"] for variable in self._variables()}

    def forced(self) -> list[str]:
        return [variable["name"] for variable in self._variables() if variable["forced"] is not None]

    def orphans(self) -> list[str]:
        """Locks whose owner is no living writer, the operator's among them, and forces: whoever made them is done."""
        status, locks = self.ask("/v1/status"), self.ask("/v1/locks")
        if status is None or locks is None:
            return []
        alive = {writer["name"] for cell in status["cells"] for writer in cell["writers"] if writer["alive"]}
        # In this order a lock taken between the two answers may look orphaned; the second look shows it.
        owned = [
            lock["name"]
            for lock in locks["locks"]
            if lock["owner"] is not None and lock["owner"] not in alive
        ]
        return owned + [f"{name} (forced)" for name in self.forced()]

    def locks_of(self, owner: str) -> list[str]:
        found = self.ask("/v1/locks")
        return [lock["name"] for lock in found["locks"] if lock["owner"] == owner] if found else [owner]

    def _variables(self) -> list[dict[str, Any]]:
        found = self.ask("/v1/variables")
        return found["variables"] if found else []


def descriptors(process: int) -> int:
    return sum(1 for _ in Path(f"/proc/{process}/fd").iterdir())


def threads(process: int) -> int:
    return sum(1 for _ in Path(f"/proc/{process}/task").iterdir())


def torn(audit: Path) -> list[str]:
    """Lines of the audit file that are no whole record. The last one may be in the making."""
    found = []
    for line in audit.read_text("utf-8", "replace").split("\n")[:-1]:
        try:
            json.loads(line)
        except ValueError:
            found.append(line)
    return found
