"""A log as the daemon writes it, with a clock of its own."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from gatewayd.logs import merging
from gatewayd.logs.records import Format, configure


class Log:
    """What was written, and the clock of the handler."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.stream, self.now = io.StringIO(), 1000.0
        monkeypatch.setattr(merging, "clock", SimpleNamespace(now=lambda: self.now))
        configure(Format.JSON, logging.DEBUG, self.stream)

    def lines(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.stream.getvalue().splitlines()]

    def count(self) -> int:
        """Lines that the written ones stand for."""
        return sum(line.get("merged", 1) for line in self.lines())

    def flush(self) -> None:
        handler = logging.getLogger().handlers[0]
        assert isinstance(handler, merging.MergingHandler)
        handler.flush_merged()

    def close(self) -> None:
        """Write what was merged."""
        logging.getLogger().handlers[0].close()


@contextmanager
def written_log(monkeypatch: pytest.MonkeyPatch) -> Iterator[Log]:
    """The log of this process meanwhile."""
    root = logging.getLogger()
    before = root.handlers[:], root.level, logging.raiseExceptions
    try:
        yield Log(monkeypatch)
    finally:
        root.handlers[:], root.level, logging.raiseExceptions = before
