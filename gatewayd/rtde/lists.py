"""Whether a controller takes long lists of names: what one connection shows, and what is remembered of it.

Only an answer is a statement. A recipe refused without a word for any field is dealt with on the connection itself and
needs no memory; a complaint in words followed by silence ends the connection, and the next one uses short lists. A
connection lost at a long list, or an answer that came too late, states nothing: the same is tried again. As a
controller may always treat long lists so, two such failures in a row lead to short lists all the same; nothing is left
unread by them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from gatewayd.rtde.messages import ControllerVersion

_FAILURES = 2


class ListOutcome(NamedTuple):
    """What a connection that has ended showed of lists."""

    controller: ControllerVersion | None
    """Software of the controller; None if the connection did not get that far."""
    took_long: bool
    """A long list was accepted."""
    failed_at_long: bool
    """It ended while the answer to a long list was due."""
    complained: bool
    """The controller had sent an error message instead of that answer."""


@dataclass(slots=True)
class ListMemory:
    """What is known of a controller over its connections."""

    _stated: ControllerVersion | None = None
    _failures: int = 0

    @property
    def limited(self) -> bool:
        """Whether the next connection is to use short lists."""
        return self._stated is not None or self._failures >= _FAILURES

    def learn(self, outcome: ListOutcome, *, started: bool) -> None:
        """Take in the end of a connection that was made as `limited` said; `started`: it had come to a session."""
        if outcome.controller not in {None, self._stated}:
            self._stated = None  # other software: other limits
        if outcome.failed_at_long:
            self._failures += 1
            if outcome.complained:
                self._stated = outcome.controller
        elif outcome.took_long:
            self._failures = 0
        elif started and self._failures >= _FAILURES:
            self._failures = _FAILURES - 1  # try the long list once more, as failures need not mean a limit
