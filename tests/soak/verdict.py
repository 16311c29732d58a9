"""What a soak run measured, and whether that is good: pure, so that it can be tested without running an hour."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from statistics import linear_regression, median

from tests.benchmarks.report import Table

MEMORY_BOUND = 8 * 1024
"""Kilobytes by which memory may grow from the second quarter of the run to the last."""
THREADS_BOUND = 4
"""Threads that may be more at the end than at the beginning: the event loop's pool grows when it is needed."""
_SHOWN = 20
"""Lines about what the robot held; where there are more, they say the same."""

_DEFINITION = """\
Recovery: from the end of the fault until the daemon calls itself healthy, PLCs and master are alive, what they write
comes back from the robot, and the status page answers. Memory: VmRSS; growth from the median of the run's second
quarter to that of its last."""


@dataclass(frozen=True, slots=True)
class Sample:
    """The daemon while all is well."""

    time: float
    """Seconds since the run began."""
    kilobytes: int
    descriptors: int
    threads: int


@dataclass(slots=True)
class Measured:
    """Filled while the run goes on."""

    recoveries: dict[str, list[float]] = field(default_factory=dict)
    """Seconds, by kind of fault."""
    failures: list[str] = field(default_factory=list)
    """Faults that were not recovered in time, in words; the daemon's end."""
    samples: list[Sample] = field(default_factory=list)
    leaked: list[str] = field(default_factory=list)
    """Locks without a living owner, and forces that stayed."""
    lies: list[str] = field(default_factory=list)
    """What the robot held and should not have, and what was acknowledged and never there."""
    descriptors_at_end: int = 0
    """With everything of the run's own gone but what was there at the first sample."""

    @property
    def growth(self) -> float:
        """Kilobytes; 0 if there are too few samples to tell."""
        quarter = len(self.samples) // 4
        if not quarter:
            return 0.0
        sizes = [sample.kilobytes for sample in self.samples]
        return median(sizes[-quarter:]) - median(sizes[quarter : 2 * quarter])

    @property
    def slope(self) -> float:
        """Kilobytes per hour, over the second half of the run."""
        half = self.samples[len(self.samples) // 2 :]
        if len(half) < 2:
            return 0.0
        return (
            3600
            * linear_regression([sample.time for sample in half], [sample.kilobytes for sample in half]).slope
        )

    def verdict(self) -> list[str]:
        """What is not as it should be; empty for a good run."""
        return list(self._faulty())

    def _faulty(self) -> Iterator[str]:
        yield from self.failures
        yield from self.lies[:_SHOWN]
        if self.lies[_SHOWN:]:
            yield f"and {len(self.lies) - _SHOWN} more of what the robot held"
        if not self.samples:
            yield "nothing was measured"
            return
        first = self.samples[0].descriptors
        if self.descriptors_at_end > first:
            yield f"descriptors grew from {first} to {self.descriptors_at_end}"
        begun, left = self.samples[0].threads, self.samples[-1].threads
        if left > begun + THREADS_BOUND:
            yield f"threads grew from {begun} to {left}"
        if self.growth > MEMORY_BOUND:
            yield f"memory grew by {self.growth:.0f} kB, more than {MEMORY_BOUND}"
        if self.leaked:
            yield f"locks without a living owner, or forces that stayed: {', '.join(sorted(set(self.leaked)))}"

    def tables(self) -> list[Table]:
        """Faults by kind, and the daemon."""
        faults = Table("Faults", _DEFINITION, ("fault", "count", "median", "longest recovery"))
        for kind, times in sorted(self.recoveries.items()):
            faults.add(kind, str(len(times)), f"{median(times) * 1000:.0f} ms", f"{max(times) * 1000:.0f} ms")
        every = [took for times in self.recoveries.values() for took in times]
        faults.add("all", str(len(every)), "", f"{max(every, default=0.0) * 1000:.0f} ms")
        daemon = Table(
            "The daemon", "Sampled after each fault.", ("what", "first", "last", "greatest", "trend")
        )
        if self.samples:
            first, last = self.samples[0], self.samples[-1]
            daemon.add(
                "memory, kB",
                str(first.kilobytes),
                str(last.kilobytes),
                str(max(sample.kilobytes for sample in self.samples)),
                f"{self.growth:+.0f} since the second quarter, {self.slope:+.0f} per hour",
            )
            greatest = str(max(sample.descriptors for sample in self.samples))
            daemon.add("descriptors", str(first.descriptors), str(self.descriptors_at_end), greatest)
            greatest = str(max(sample.threads for sample in self.samples))
            daemon.add("threads", str(first.threads), str(last.threads), greatest)
        daemon.add("locks leaked", "", str(len(self.leaked)))
        return [faults, daemon]
