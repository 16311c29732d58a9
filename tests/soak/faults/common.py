"""What faults of several links do."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from tests.e2e.processes import Process, wait_for
from tests.soak.rig import PATIENCE, Rig
from tests.soak.truth import LATELY, Period


def kill_writer(rig: Rig, name: str) -> None:
    """Its locks are free before it comes back."""
    rig.end_client(name)
    wait_for(lambda: not rig.look.locks_of(name), f"the locks of {name} to be free", PATIENCE)
    rig.start_client(name)


@contextmanager
def unjudged(rig: Rig, fields: Sequence[str], value: float | None = None) -> Iterator[None]:
    """Meanwhile these fields may come to hold the value, or any; and as long after as a write of it may take."""
    begin = time.monotonic()
    try:
        yield
    finally:
        end = time.monotonic() + LATELY
        rig.record.periods.append(Period(begin, end, fields, value))


def suspend(process: Process, meanwhile: Callable[[], object]) -> None:
    process.signal(signal.SIGSTOP)
    try:
        meanwhile()
    finally:
        process.signal(signal.SIGCONT)
