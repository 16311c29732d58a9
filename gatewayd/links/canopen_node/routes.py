"""Who gets which frames of the bus: by COB-ID, and by what the present NMT state allows."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.nmt import ALLOWED, NmtState, Service

Handler = Callable[[Frame, float], None]


class Routes:
    """The services of one node by COB-ID."""

    def __init__(self) -> None:
        self.handlers: dict[int, Handler] = {}
        """Who runs in the present NMT state."""
        self._all: Mapping[int, tuple[Service, Handler]] = {}

    @property
    def cob_ids(self) -> frozenset[int]:
        """Those that mean anything, in any NMT state."""
        return frozenset(self._all)

    def replace(self, routes: Mapping[int, tuple[Service, Handler]], state: NmtState) -> bool:
        """Have these routes from now on; whether they are of other COB-IDs."""
        changed = routes.keys() != self._all.keys()
        self._all = routes
        self.gate(state)
        return changed

    def gate(self, state: NmtState) -> None:
        """Let those services have frames that run in this NMT state."""
        allowed = ALLOWED[state]
        self.handlers = {
            can_id: handler for can_id, (service, handler) in self._all.items() if service in allowed
        }
