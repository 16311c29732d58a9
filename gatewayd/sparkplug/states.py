"""The states of an edge node, and what leads from one to another (specification 5.4, 5.5, 5.17)."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto


class EdgeNodeState(Enum):
    """What there is: no session, a session, births that are due, data."""

    OFFLINE = "offline"
    """No MQTT session, or one that is being left."""
    WAITING = "waiting for the primary host"
    """A session, and no primary host application that is online."""
    BEARING = "sending births"
    """Births are due, and no data is sent yet."""
    ONLINE = "online"


class EdgeNodeSignal(Enum):
    """What happens to it."""

    CONNECTED = auto()
    LOST = auto()
    HOST_ONLINE = auto()
    """The primary host application is there, or none is waited for."""
    HOST_OFFLINE = auto()
    REBIRTH = auto()
    BORN = auto()
    """All births are on their way."""
    CLOSED = auto()


_S, _E = EdgeNodeState, EdgeNodeSignal

TRANSITIONS: Mapping[tuple[EdgeNodeState, EdgeNodeSignal], EdgeNodeState] = {
    (_S.OFFLINE, _E.CONNECTED): _S.WAITING,
    (_S.WAITING, _E.HOST_ONLINE): _S.BEARING,
    (_S.WAITING, _E.LOST): _S.OFFLINE,
    (_S.WAITING, _E.CLOSED): _S.OFFLINE,
    (_S.BEARING, _E.BORN): _S.ONLINE,
    (_S.BEARING, _E.REBIRTH): _S.BEARING,
    (_S.BEARING, _E.HOST_OFFLINE): _S.OFFLINE,
    (_S.BEARING, _E.LOST): _S.OFFLINE,
    (_S.BEARING, _E.CLOSED): _S.OFFLINE,
    (_S.ONLINE, _E.REBIRTH): _S.BEARING,
    (_S.ONLINE, _E.HOST_OFFLINE): _S.OFFLINE,
    (_S.ONLINE, _E.LOST): _S.OFFLINE,
    (_S.ONLINE, _E.CLOSED): _S.OFFLINE,
}
"""State and signal -> next state. Other signals change nothing."""
