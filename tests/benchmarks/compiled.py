"""Programs in C to compare with, compiled on the spot where a compiler and libmodbus's headers are there."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HEADERS = "-I/usr/include/modbus"


def libmodbus_is_there() -> bool:
    """Whether a C compiler and libmodbus's headers can be found."""
    compiler = shutil.which("cc")
    if compiler is None:
        return False
    source = b"#include <modbus.h>\nint main(void) { return 0; }"
    command = [compiler, HEADERS, "-xc", "-fsyntax-only", "-"]
    return subprocess.run(command, input=source, capture_output=True, check=False).returncode == 0


@contextmanager
def compiled(name: str) -> Iterator[str]:
    """The program of the source `name`.c beside this module."""
    source = Path(__file__).with_name(f"{name}.c")
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, name)
        subprocess.run(["cc", "-O2", HEADERS, "-o", program, source, "-lmodbus"], check=True)
        yield str(program)
