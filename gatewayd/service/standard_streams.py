"""Standard streams that may be closed, full, or without the characters of Unicode: a command says so and ends.

What Python makes of them instead: `None` for one that was closed (and the number for the next socket), an error in the
middle of a table for a terminal that knows ASCII alone, and an exception at the interpreter's end for a full disk.
"""

from __future__ import annotations

import codecs
import io
import os
import sys
from typing import Any, TextIO

OUTPUT, ERRORS = 1, 2
"""File descriptors."""
ESCAPES = "gatewayd.escapes"
"""Name of the error handler for what a stream's encoding does not have."""
_ASCII = "gatewayd_ascii"
"""ASCII by a name of its own: click takes a stream of plain `ascii` for a mistake and writes UTF-8 to it."""
_NO_UNICODE = {
    "\u2026": "~",
    "\u2192": ">",
    "\u2190": "<",
    "\u25cf": "*",
    "\u2013": "-",
    "\u2014": "-",
    "\u258f": "|",
}
"""Signs of our own that have one character of ASCII with the same meaning, so that columns stay in line."""


class OutputError(OSError):
    """Standard output takes no more: its file is full, or it was closed from the start."""


class _Output(io.FileIO):
    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except (BrokenPipeError, InterruptedError):
            raise
        except OSError as error:
            raise OutputError(error.errno, error.strerror) from error


class _Errors(io.FileIO):
    def write(self, data: Any, /) -> int:
        """Write, or lose it: where nothing can be said, nothing else should fail for that."""
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


def prepare() -> None:
    """Open what was closed, and have `sys.stdout` and `sys.stderr` fail as this module says. To be called first."""
    codecs.register_error(ESCAPES, _escaped)
    codecs.register(_named)
    _fill()
    sys.stdin = sys.stdin or open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - it lasts
    sys.stdout = _stream(_Output(OUTPUT, "w", closefd=False), sys.stdout, line_buffering=os.isatty(OUTPUT))
    sys.stderr = _stream(_Errors(ERRORS, "w", closefd=False), sys.stderr, line_buffering=True)


def forget_output() -> None:
    """Point stdout at nothing, so that the interpreter's own flush at exit does not complain."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, OUTPUT)
    os.close(null)


def _fill() -> None:
    """Take the numbers of closed streams, so that no socket gets them. What is written to a closed output fails."""
    for descriptor, mode in ((0, os.O_RDONLY), (OUTPUT, os.O_RDONLY), (ERRORS, os.O_WRONLY)):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, mode)


def _stream(raw: io.FileIO, former: TextIO | None, *, line_buffering: bool) -> TextIO:
    encoding = "utf-8" if former is None else former.encoding
    if codecs.lookup(encoding).name == "ascii":
        encoding = _ASCII
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding=encoding, errors=ESCAPES, line_buffering=line_buffering
    )


def _named(name: str) -> codecs.CodecInfo | None:
    if name != _ASCII:
        return None
    ascii_codec = codecs.lookup("ascii")
    return codecs.CodecInfo(
        ascii_codec.encode,
        ascii_codec.decode,
        ascii_codec.streamreader,
        ascii_codec.streamwriter,
        ascii_codec.incrementalencoder,
        ascii_codec.incrementaldecoder,
        _ASCII,
    )


def _escaped(error: UnicodeError) -> tuple[str, int]:
    r"""A sign of ASCII, or `\uXXXX`: in JSON that is the same text."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    characters = error.object[error.start : error.end]
    return "".join(_NO_UNICODE.get(character) or _units(character) for character in characters), error.end


def _units(character: str) -> str:
    data = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{data[at]:02x}{data[at + 1]:02x}" for at in range(0, len(data), 2))
