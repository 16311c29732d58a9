"""One soak run: fault after fault, each waited for to be over, until the time is up."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random

from gatewayd.control.client import ControlError, NoDaemon
from tests.e2e.processes import wait_for
from tests.soak.cell import ECHOES
from tests.soak.faults import FAULTS, ROUND, bound
from tests.soak.look import descriptors, threads, torn
from tests.soak.rig import PATIENCE, WRITERS, Rig
from tests.soak.verdict import Measured, Sample

PAUSES = {"real": (5.0, 30.0), "fast": (0.0, 0.3)}
"""Seconds between two faults."""
_WARM_UP = 1.0
_SETTLED = 10.0
"""Seconds for connections that nobody ends: three of idle time-out, and the look for it."""


def kinds(seed: int, among: Sequence[str] = ROUND) -> Iterator[tuple[str, Random]]:
    """Round after round in random order, each kind with the chance that it draws from."""
    chance = Random(seed)
    while True:
        for kind in chance.sample(among, len(among)):
            # Its own, so that what one fault draws, which may depend on timing, moves no other.
            yield kind, Random(chance.getrandbits(64))


def soak(
    directory: Path,
    seconds: float,
    seed: int,
    speed: str,
    say: Callable[[str], None] = lambda _line: None,
    *,
    among: Sequence[str] = ROUND,
) -> Measured:
    """Run; ends early only if the daemon does. `say` hears of every fault."""
    measured = Measured()
    rig = Rig(directory)
    try:
        time.sleep(_WARM_UP)
        begin = time.monotonic()
        _sample(rig, measured, begin)
        for kind, chance in kinds(seed, among):
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
    measured.failures += [f"the daemon's log: {line}" for line in _defects(rig)]
    return measured


def _defects(rig: Rig) -> list[str]:
    """Exceptions that nobody expected, as the log has them or as Python does."""
    return rig.daemon.lines(" trace=") + rig.daemon.lines("Traceback")


def _one(rig: Rig, kind: str, chance: Random, measured: Measured) -> str:
    """Do it, wait until it is over; what came of it."""
    try:
        FAULTS[kind](rig, chance)
        before = rig.look.echoes()
        took = wait_for(lambda: _well(rig, before), "recovery", bound(kind))
    except (AssertionError, OSError, ControlError, NoDaemon) as error:
        complaint = f"{error}; {'; '.join(rig.look.ills()) or 'all well'}"
        measured.failures.append(f"{kind}: {complaint}")
        if rig.daemon.running:
            rig.mend()
            time.sleep(1)
        return complaint
    measured.recoveries.setdefault(kind, []).append(took)
    return f"{took * 1000:.0f} ms"


def _well(rig: Rig, before: dict[str, object]) -> bool:
    """Whether the daemon has no complaint, shows its page, and what every writer writes came back anew."""
    if rig.look.ills():
        return False
    now = rig.look.echoes()
    moved = len(now) == ECHOES and all(now[name] != before.get(name) for name in now)
    return moved and rig.look.page()


def _sample(rig: Rig, measured: Measured, begin: float) -> None:
    process = rig.daemon
    now = time.monotonic() - begin
    measured.samples.append(
        Sample(now, process.resident_kilobytes(), descriptors(process.pid), threads(process.pid))
    )
    first = set(rig.look.orphans())
    if first:
        # Between its two questions a lock may have changed hands; a leaked one is there for longer.
        time.sleep(0.1)
        measured.leaked += first & set(rig.look.orphans())


def _close(rig: Rig, measured: Measured) -> None:
    """Descriptors come back to what they were; with the last writer the last lock is free."""
    first, process = measured.samples[0].descriptors, rig.daemon.pid
    end = time.monotonic() + _SETTLED
    while descriptors(process) > first and time.monotonic() < end:
        time.sleep(0.1)
    measured.descriptors_at_end = descriptors(process)
    measured.failures += rig.complaints()
    measured.lies = rig.lies()
    measured.failures += [f"the audit has a torn line: {line[:200]}" for line in torn(rig.audit)]
    for name in WRITERS:
        rig.end_client(name)
    for name in WRITERS:
        try:
            wait_for(lambda name=name: not rig.look.locks_of(name), f"the locks of {name}", PATIENCE)  # type: ignore[misc]
        except AssertionError:
            measured.leaked += rig.look.locks_of(name)
