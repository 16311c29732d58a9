"""How far recording and reading are, in words: a line meanwhile and one at the end. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.report.format import counted, span

_UNITS = ("B", "kB", "MB", "GB", "TB")
_STEP = 1000.0


@dataclass(frozen=True, slots=True)
class Tally:
    """How far a recording is."""

    seconds: float = 0.0
    """Since the first package was recorded."""
    packages: int = 0
    """Recorded."""
    size: int = 0
    """Bytes of the file."""
    rate: float = 0.0
    """Packages that come per second, recorded or not."""
    skipped: int = 0
    """Packages that are missing in the recording though they were wanted."""
    gaps: int = 0
    """Places at which some are missing, or at which it is not known how many."""
    left_out: int = 0
    """Packages that a condition left out."""
    waiting: str = ""
    """What is being waited for, in words; empty while packages are recorded."""


def progress_line(tally: Tally) -> str:
    """`12 s   6000 packages   500 Hz   1.3 MB   none skipped`, and what is waited for."""
    parts = [
        span(tally.seconds),
        counted(tally.packages, "package"),
        f"{tally.rate:.0f} Hz",
        size_text(tally.size),
        _missing(tally),
    ]
    return "   ".join([*parts, tally.waiting] if tally.waiting else parts)


def reading_line(position: int, total: int, packages: int) -> str:
    """` 42%, 6000 packages`: of the bytes of a file."""
    return f"{position / total if total else 1:4.0%}, {counted(packages, 'package')}"


def summary(path: str, tally: Tally, sidecar: str) -> str:
    """The last line: what the file has, and what it lacks."""
    found = f"{path}: {counted(tally.packages, 'package')} in {span(tally.seconds)}, {size_text(tally.size)}"
    left_out = f", {tally.left_out} left out by the condition" if tally.left_out else ""
    see = f"; see {sidecar}" if tally.gaps or tally.left_out else ""
    return f"{found}, {_missing(tally)}{left_out}{see}"


def size_text(size: float) -> str:
    """`12 B`, `1.3 MB`: three digits at most before the unit."""
    for unit in _UNITS[:-1]:
        if size < _STEP:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= _STEP
    return f"{size:.1f} {_UNITS[-1]}"


def _missing(tally: Tally) -> str:
    if tally.skipped:
        return f"{tally.skipped} skipped"
    return f"{counted(tally.gaps, 'gap')}" if tally.gaps else "none skipped"
