"""What faults of several links do."""

from __future__ import annotations

import signal
from collections.abc import Callable

from tests.e2e.processes import Process, wait_for
from tests.soak.rig import PATIENCE, Rig

__all__ = ["kill_writer", "suspend"]


def kill_writer(rig: Rig, name: str) -> None:
    """Its locks are free before it comes back."""
    rig.end_client(name)
    wait_for(lambda: not rig.look.locks_of(name), f"the locks of {name} to be free", PATIENCE)
    rig.start_client(name)


def suspend(process: Process, meanwhile: Callable[[], object]) -> None:
    process.signal(signal.SIGSTOP)
    try:
        meanwhile()
    finally:
        process.signal(signal.SIGCONT)
