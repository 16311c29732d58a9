"""Structured logs on the standard library: one line per event, for people, for programs or for the journal.

An event is an ordinary logging call whose fields travel beside its text:
`log.info("robot connected", extra=fields(cell="press-3"))`.
Whatever a peer sent stays on its line (`report.printable`): no field and no text can break it or colour a terminal.
"""

from __future__ import annotations

import json
import logging
import os
import re
import sys
import time
import traceback
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import Protocol

from gatewayd.logs.merging import MergingHandler
from gatewayd.report.printable import printable


class Stream(Protocol):
    """What lines are written to."""

    def write(self, text: str, /) -> object:
        """Write one line with its end."""

    def flush(self) -> None:
        """Write it now."""

    def fileno(self) -> int:
        """The file behind it; OSError or ValueError if there is none."""


class Format(Enum):
    """How a line looks."""

    TEXT = "text"
    """`2026-11-22T09:00:00.123Z info  robot connected cell=press-3`: UTC, level, event, fields as logfmt."""
    JSON = "json"
    """One object per line: `time`, `level`, `logger`, `event`, then the fields."""
    JOURNAL = "journal"
    """`<6>robot connected cell=press-3`: the priority of sd-daemon(3); the journal knows the time itself."""
    AUTO = "auto"
    """JOURNAL where the stream is connected to systemd's journal, else TEXT."""


LEVELS = {
    logging.DEBUG: ("debug", 7),
    logging.INFO: ("info", 6),
    logging.WARNING: ("warn", 4),
    logging.ERROR: ("error", 3),
    logging.CRITICAL: ("crit", 2),
}
"""Level -> its name on the line and its syslog priority (RFC 5424, 6.2.1)."""

LIBRARIES = ("asyncio", "pymodbus")
"""Loggers whose chatter below a warning is not ours to repeat."""


def fields(**values: object) -> dict[str, object]:
    """What to hand to a logging call as `extra`. Strings, numbers, booleans and None keep their type in JSON."""
    return {"fields": values}


def configure(form: Format = Format.AUTO, level: int = logging.INFO, stream: Stream | None = None) -> None:
    """Send every event of at least `level` to `stream` (default: stderr); replaces what was configured before.

    A stream that went away is no reason to stop: the event is lost, and nothing is raised. What is the same again and
    again is merged (`logs.merging`).
    """
    target: Stream = sys.stderr if stream is None else stream
    if form is Format.AUTO:
        form = Format.JOURNAL if _is_journal(target) else Format.TEXT
    handler = MergingHandler(target)
    handler.setFormatter(_FORMATTERS[form]())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)
    logging.raiseExceptions = False
    for name in LIBRARIES:
        logging.getLogger(name).setLevel(max(level, logging.WARNING))


class _Text(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return f"{_timestamp(record)} {_level(record)[0]:<5} {_event(record)}"


class _Journal(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return f"<{_level(record)[1]}>{_event(record)}"


class _Json(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        own = {
            "time": _timestamp(record),
            "level": _level(record)[0],
            "logger": record.name,
            "event": record.getMessage(),
        }
        found = {name: _json(value) for name, value in _fields(record).items() if name not in own}
        return json.dumps(own | found)


_FORMATTERS = {Format.TEXT: _Text, Format.JSON: _Json, Format.JOURNAL: _Journal}


def _timestamp(record: logging.LogRecord) -> str:
    """UTC with milliseconds, RFC 3339."""
    milliseconds = int(record.created * 1000)
    seconds = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(milliseconds // 1000))
    return f"{seconds}.{milliseconds % 1000:03d}Z"


def _level(record: logging.LogRecord) -> tuple[str, int]:
    """The entry of the greatest listed level that does not exceed the record's."""
    return LEVELS[max((level for level in LEVELS if level <= record.levelno), default=logging.DEBUG)]


def _event(record: logging.LogRecord) -> str:
    """The text and the fields as logfmt, on one line."""
    pairs = (f"{name}={_logfmt(value)}" for name, value in _fields(record).items())
    return " ".join([printable(record.getMessage()), *pairs])


def _fields(record: logging.LogRecord) -> dict[str, object]:
    """The event's own fields; for an exception also what it was and where, innermost call first."""
    found: dict[str, object] = dict(getattr(record, "fields", ()))
    if record.exc_info and record.exc_info[1] is not None:
        error = record.exc_info[1]
        frames = reversed(traceback.extract_tb(error.__traceback__))
        found["exception"] = f"{type(error).__name__}: {error}"
        found["trace"] = " < ".join(f"{Path(at.filename).name}:{at.lineno} {at.name}" for at in frames)
    return found


_PLAIN = re.compile(r"[!#-<>-\[\]-~\u00a1-\uffff]+")
"""A value that needs no quotes: no blank, quote, equals sign or backslash."""


def _logfmt(value: object) -> str:
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    text = str(value)
    shown = printable(text)
    if shown == text and _PLAIN.fullmatch(text):
        return text
    return '"' + printable(text.replace("\\", "\\\\").replace('"', '\\"')) + '"'


def _json(value: object) -> object:
    """`value` where JSON has it, else its text: NaN and infinity too."""
    plain = (
        value is None or isinstance(value, (str, bool, int)) or (isinstance(value, float) and isfinite(value))
    )
    return value if plain else str(value)


def _is_journal(stream: Stream) -> bool:
    """Whether `stream` is the very file that JOURNAL_STREAM names as "device:inode" (systemd.exec(5))."""
    try:
        status = os.fstat(stream.fileno())
    except (OSError, ValueError):
        return False
    return os.environ.get("JOURNAL_STREAM") == f"{status.st_dev}:{status.st_ino}"
