"""Which files are meant by what a command line names. Light: `gatewayd run` asks before it imports anything else."""

from __future__ import annotations

from os.path import isdir
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
"""What the names of mapping files end in, in whatever case."""
PATTERNS = ", ".join(f"*{suffix}" for suffix in SUFFIXES)


def files_of(path: Path) -> list[Path]:
    """The files meant by a path: itself, or what a directory holds of mapping files, by name.

    As in a shell, no name with a dot in front is meant: editors and copy tools keep halves of files under such names.
    Raises OSError for a directory that cannot be read.
    """
    # Path.is_dir would raise for a name that no file can have; such a name is reported when it is opened.
    if not isdir(path):  # noqa: PTH112
        return [path]
    return sorted(
        file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")
    )
