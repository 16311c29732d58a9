"""The process that compiles mapping files for another one (`service.compilation`): one pickled `Compiled` to standard
output, and the end. For people there is `gatewayd check`.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from gatewayd.mapping.compiled import Compiled, CompiledFile, Unreadable
from gatewayd.mapping.loader import load_together, read_bytes


def compile_files(names: Iterable[str]) -> Compiled:
    """Read, check and compile; the files are to run in one process. Never raises, whatever is named.

    Their `tests` are not even read: a mistake in one keeps no cell from being served.
    """
    files: list[tuple[str, bytes]] = []
    unreadable: list[Unreadable] = []
    for name in names:
        try:
            files.append((name, read_bytes(Path(name))))
        except (OSError, ValueError) as error:
            unreadable.append(Unreadable(name, getattr(error, "strerror", None) or str(error)))
    loaded = load_together(files, tests=False)
    return Compiled(
        tuple(CompiledFile(file.name, file.diagnostics, file.plan) for file in loaded), tuple(unreadable)
    )


def names_from(stream: BinaryIO) -> list[str]:
    """The names of files as `service.compilation` writes them: one a line, in hexadecimal digits, then an empty line.

    Raises EOFError if the process that was to send them is gone.
    """
    names: list[str] = []
    while (line := stream.readline()) != b"\n":
        if not line:
            raise EOFError("no files were named")
        names.append(os.fsdecode(bytes.fromhex(line.decode())))
    return names


def main(names: Iterable[str]) -> None:
    """Compile these files."""
    sys.stdout.buffer.write(pickle.dumps(compile_files(names), pickle.HIGHEST_PROTOCOL))
