"""What a process, and everybody on the machine, used of it until now: read from /proc, one file each (proc(5))."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

TICK = 1 / os.sysconf("SC_CLK_TCK")
_BUSY = (0, 1, 2)
"""user, nice and system in the line `cpu` of /proc/stat."""
_STEAL = 7


@dataclass(frozen=True, slots=True)
class Usage:
    """Until a moment, or the difference of two: seconds, and times."""

    wall: float = 0.0
    cpu: float = 0.0
    """CPU time of the process, by the scheduler's own count: exact where ticks of 10 ms are not."""
    switches: int = 0
    """How often it was taken from the CPU though it wanted to go on (nonvoluntary_ctxt_switches)."""
    steal: float = 0.0
    """CPU time that the hypervisor gave to other machines, over all cores."""
    others: float = 0.0
    """CPU time of all processes that are none of ours, over all cores."""

    def __sub__(self, earlier: Usage) -> Usage:
        return Usage(*(getattr(self, one.name) - getattr(earlier, one.name) for one in fields(self)))

    def __add__(self, other: Usage) -> Usage:
        return Usage(*(getattr(self, one.name) + getattr(other, one.name) for one in fields(self)))


def usage(pid: int) -> Usage:
    """Of the process and the machine, now."""
    machine = machine_times(Path("/proc/stat").read_text("ascii"))
    tasks = list(Path(f"/proc/{pid}/task").iterdir())
    return Usage(
        wall=time.monotonic(),
        cpu=sum(int((task / "schedstat").read_text("ascii").split()[0]) for task in tasks) / 1e9,
        switches=sum(switches((task / "status").read_text("ascii")) for task in tasks),
        steal=machine[1],
        others=machine[0] - ours(_processes(), os.getpid()),
    )


def machine_times(stat: str) -> tuple[float, float]:
    """Seconds in which processes ran, and stolen ones, from the text of /proc/stat."""
    ticks = [int(word) for word in stat.splitlines()[0].split()[1:]]
    return sum(ticks[index] for index in _BUSY) * TICK, ticks[_STEAL] * TICK


def switches(status: str) -> int:
    """Involuntary context switches, from the text of /proc/PID/status."""
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("nonvoluntary"))


def ours(processes: Iterable[tuple[int, int, float]], root: int) -> float:
    """CPU seconds of `root` and all that descend from it; a process is (number, parent, seconds)."""
    children: dict[int, list[tuple[int, float]]] = {}
    total = 0.0
    for number, parent, seconds in processes:
        children.setdefault(parent, []).append((number, seconds))
        if number == root:
            total += seconds
    waiting = [root]
    while waiting:
        for number, seconds in children.get(waiting.pop(), ()):
            total += seconds
            waiting.append(number)
    return total


def _processes() -> Iterable[tuple[int, int, float]]:
    """All of them, each with the time of those children of it that have ended."""
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            words = (folder / "stat").read_text("utf-8", "replace").rpartition(")")[2].split()
        except OSError:
            continue  # it has ended meanwhile
        yield int(folder.name), int(words[1]), sum(int(word) for word in words[11:15]) * TICK
