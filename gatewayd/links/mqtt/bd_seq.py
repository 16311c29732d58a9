"""The birth/death sequence number of an edge node, kept across restarts (tck-id-topics-nbirth-bdseq-increment)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from gatewayd.whole_file import whole_file

_MAX: Final = 255
_UNSAFE = re.compile(r"[^A-Za-z0-9-]")


def bd_seq_file(state: Path, group: str, node: str) -> Path:
    """Where it is kept. Names may have characters that files cannot have: those are written as numbers."""
    safe = (_UNSAFE.sub(lambda found: f"_{ord(found[0]):x}_", name) for name in (group, node))
    return state / f"sparkplug.{'.'.join(safe)}.bdseq"


def read_bd_seq(file: Path) -> int:
    """The number of the next connection; 0 where none was kept, or what was kept is none."""
    try:
        text = file.read_text("ascii").strip()
    except (OSError, ValueError):
        return 0
    return int(text) if text.isdecimal() and len(text) <= len(str(_MAX)) and int(text) <= _MAX else 0


def write_bd_seq(file: Path, number: int) -> None:
    """Keep it, on the disk when this returns. OSError."""
    with whole_file(file, overwrite=True) as path:
        path.write_text(f"{number}\n", "ascii")
