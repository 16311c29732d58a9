"""Devices by others as processes of their own, and a manager that cares for them."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.manager.node import ManagedNode
from gatewayd.canopen.manager.plan import (
    ExpectedIdentity,
    ManagedPdo,
    ManagerPlan,
    NodePlan,
    ObjectReading,
    PdoObject,
    Setting,
)
from gatewayd.canopen.manager.runtime import Manager
from tests.canopen.manager.bench import Diary
from tests.canopen.manager.foreign_node import VENDOR
from tests.e2e.processes import Process

POSITION = PdoObject(0x6004, 0, 32, CanType.UNSIGNED32)
OUTPUT = PdoObject(0x6200, 0, 8, CanType.UNSIGNED8)
NODES = {"canopen": 5, "durand": 6}
PATIENCE = 10.0


class Foreign(Process):
    """A device by somebody else."""

    def __init__(self, kind: str, channel: str, log: Path, interface: str = "slcan") -> None:
        self.kind, self.node = kind, NODES[kind]
        module = [sys.executable, "-m", "tests.canopen.manager.foreign_node"]
        words = [*module, kind, interface, channel, str(self.node)]
        super().__init__(words, log)

    def do(self, *command: Any) -> Any:
        """Carry out a command; its result."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(json.dumps(command) + "\n")
        return json.loads(self.answer())


@asynccontextmanager
async def managing(channel: str, interface: str = "slcan") -> AsyncIterator[Manager]:
    """A manager at work."""
    manager = Manager(ManagerPlan(interface, channel, 500_000, node=127, heartbeat=100))
    task = asyncio.create_task(manager.run())
    yield manager
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def care(manager: Manager, device: Foreign, **changes: Any) -> tuple[ManagedNode, Diary]:
    """Have a device managed; its TPDO is laid out, its RPDO taken as it is."""
    node, diary = device.node, Diary()
    settings: dict[str, Any] = {
        "expected": ExpectedIdentity(0x20196, VENDOR),
        "heartbeat": 0.5,
        "producer": 100,
        "pdos": (
            ManagedPdo(1, True, 0x180 + node, (POSITION,), written=True, transmission=255),
            ManagedPdo(1, False, 0x200 + node, (OUTPUT,)),
        ),
        "readings": (
            ObjectReading(0x6004, 0, CanType.UNSIGNED32),
            ObjectReading(0x2000, 0, CanType.UNSIGNED16, 0.05),
        ),
        "settings": (Setting(0x2000, 0, b"\x34\x12"),),
    }
    return manager.attach(NodePlan(node, **settings | changes), diary), diary
