"""Whether this gateway was the last one that served the cell, kept across restarts as a file that is there or not.

Without it, a gateway that restarts while the other one has another mapping would leave the cell to nobody.
"""

from __future__ import annotations

import logging
from pathlib import Path

from gatewayd.logs.records import fields
from gatewayd.loop.retry import reason_of

log = logging.getLogger("gatewayd.standby")


class ServedMark:
    """The file of one cell. If it cannot be read or written, the gateway counts as one that did not serve."""

    def __init__(self, state: Path, cell: str) -> None:
        self.path = state / f"standby-{cell}.served"
        self._written: bool | None = None

    def read(self) -> bool:
        """Whether the file is there."""
        try:
            self._written = self.path.exists()
        except OSError:
            self._written = False
        return self._written

    def write(self, *, served_last: bool) -> None:
        """Have the file say so; trouble is logged, and tried again with the next change."""
        if served_last is self._written:
            return
        self._written = served_last
        try:
            if served_last:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self.path.touch()
            else:
                self.path.unlink(missing_ok=True)
        except OSError as error:
            log.warning(
                "who served the cell last cannot be kept",
                extra=fields(file=str(self.path), reason=reason_of(error)),
            )
