"""One soak run: fault after fault, each waited for to be over, until the time is up."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from tests.e2e.processes import wait_for
from tests.soak.faults import FAULTS, bound
from tests.soak.rig import FIRST, PATIENCE, SECOND, Rig
from tests.soak.verdict import Measured, Sample

__all__ = ["PAUSES", "kinds", "soak"]

PAUSES = {"real": (5.0, 30.0), "fast": (0.0, 0.3)}
"""Seconds between two faults."""
_WARM_UP = 1.0
_SETTLED = 10.0
"""Seconds for connections that nobody ends: three of idle time-out, and the look for it."""


def kinds(seed: int) -> Iterator[tuple[str, Random]]:
    """Every kind once in random order, again and again, each with the chance that it draws from."""
    chance = Random(seed)
    while True:
        for kind in chance.sample(sorted(FAULTS), len(FAULTS)):
            # Its own, so that what one fault draws, which may depend on timing, moves no other.
            yield kind, Random(chance.getrandbits(64))


def soak(
    directory: Path, seconds: float, seed: int, speed: str, say: Callable[[str], None] = lambda _line: None
) -> Measured:
    """Run; ends early only if the daemon does. `say` hears of every fault."""
    measured = Measured()
    rig = Rig(directory)
    try:
        time.sleep(_WARM_UP)
        begin = time.monotonic()
        _sample(rig, measured, begin)
        for kind, chance in kinds(seed):
            if time.monotonic() - begin >= seconds:
                break
            time.sleep(chance.uniform(*PAUSES[speed]))
            say(f"{time.monotonic() - begin:7.1f} s  {kind}: {_one(rig, kind, chance, measured)}")
            if not rig.daemon.running:
                measured.failures.append(f"{kind}: the daemon ended with {rig.daemon.popen.poll()}")
                return measured
            _sample(rig, measured, begin)
        _close(rig, measured)
    finally:
        rig.close()
    if "Traceback" in rig.daemon.text():
        measured.failures.append(f"the daemon's log has a traceback: {rig.daemon.log}")
    return measured


def _one(rig: Rig, kind: str, chance: Random, measured: Measured) -> str:
    """Do it, wait until it is over; what came of it."""
    try:
        FAULTS[kind](rig, chance)
        before = rig.echoes()
        took = wait_for(lambda: not rig.ills() and _moved(before, rig.echoes()), "recovery", bound(kind))
    except (AssertionError, OSError) as error:
        told = f"{error}; {'; '.join(rig.ills()) or 'all well'}"
        measured.failures.append(f"{kind}: {told}")
        _mend(rig)
        return told
    measured.recoveries.setdefault(kind, []).append(took)
    return f"{took * 1000:.0f} ms"


def _moved(before: dict[str, object], now: dict[str, object]) -> bool:
    """Whether what both PLCs write came back anew."""
    return len(now) == 2 and all(now[name] != before.get(name) for name in now)


def _mend(rig: Rig) -> None:
    """After a fault that stopped half-way: begin the next one with all parts there."""
    rig.end_simulator()
    rig.start_simulator()
    for name in (FIRST, SECOND):
        if name not in rig.clients:
            rig.start_client(name)
    time.sleep(1)


def _sample(rig: Rig, measured: Measured, begin: float) -> None:
    measured.samples.append(
        Sample(time.monotonic() - begin, rig.daemon.resident_kilobytes(), rig.descriptors())
    )
    first = set(rig.orphans())
    if first:
        # Between its two questions a lock may have changed hands; a leaked one is there for longer.
        time.sleep(0.1)
        measured.leaked += first & set(rig.orphans())


def _close(rig: Rig, measured: Measured) -> None:
    """Descriptors come back to what they were; with the last PLC the last lock is free."""
    first = measured.samples[0].descriptors
    end = time.monotonic() + _SETTLED
    while rig.descriptors() > first and time.monotonic() < end:
        time.sleep(0.1)
    measured.descriptors_at_end = rig.descriptors()
    for name in (FIRST, SECOND):
        rig.end_client(name)
    for name in (FIRST, SECOND):
        try:
            wait_for(lambda name=name: not rig.locks_of(name), f"the locks of {name}", PATIENCE)  # type: ignore[misc]
        except AssertionError:
            measured.leaked += rig.locks_of(name)
