"""One connection to a dashboard server without its socket: lines in, lines out, one answer to each request.

The server greets with a line. Then it answers each line with one line, in order; it says nothing unasked. What is
longer, or unasked, makes it uncertain which answer belongs to what, so the connection is of no use any more.
"""

from __future__ import annotations

MAX_LINE = 1024
"""Bytes of a line at most; the longest answer known, a path of a program, is a quarter of that."""


class DialogueError(Exception):
    """The other side does not speak as a dashboard server does; the text says how."""


class Dialogue:
    """Requests and answers of one connection; at first the greeting is awaited."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._awaits = True

    @property
    def is_awaiting(self) -> bool:
        """Whether a line of the server is due."""
        return self._awaits

    def ask(self, text: str) -> bytes:
        """The bytes of a request. ValueError for what is no single line, or while an answer is due."""
        if self._awaits:
            raise ValueError("the last answer is still due")
        if not text.isprintable() or not text.isascii():
            raise ValueError("a request is one line of ASCII")
        self._awaits = True
        return text.encode("ascii") + b"\n"

    def receive(self, data: bytes) -> str | None:
        """The line that was awaited, without its end; None: it is not complete. Raises DialogueError."""
        self._buffer += data
        line, end, rest = bytes(self._buffer).partition(b"\n")
        if len(line) > MAX_LINE:
            message = f"sent a line of more than {MAX_LINE} bytes"
            raise DialogueError(message)
        if data and not self._awaits:
            raise DialogueError("said something unasked")
        if not end:
            return None
        if rest:
            raise DialogueError("gave two answers to one request")
        self._buffer.clear()
        self._awaits = False
        return line.decode("utf-8", "replace").rstrip("\r")
