"""RTDE, the Real-Time Data Exchange of Universal Robots controllers (TCP 30004).

The public API, asyncio: `async with rtde.connect(host, outputs=["actual_q"]) as robot`. Its names are here and are
imported when they are used; `gatewayd.rtde.sync` is the same for scripts and notebooks.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gatewayd.rtde.api.errors import (
        ConnectFailedError,
        ConnectionLostError,
        FieldsRefusedError,
        NotVerifiedError,
        RtdeError,
        TypesDifferError,
        WriteRefusedError,
    )
    from gatewayd.rtde.api.events import (
        AttemptFailedEvent,
        ConnectedEvent,
        ErrorEvent,
        LostEvent,
        OverflowEvent,
        PausedEvent,
        RefusedEvent,
        RobotEvent,
        SetUpEvent,
        StartedEvent,
        TextEvent,
    )
    from gatewayd.rtde.api.feed import ConnectionState
    from gatewayd.rtde.api.properties import Properties
    from gatewayd.rtde.api.retry import Retry
    from gatewayd.rtde.api.robot import Robot, connect
    from gatewayd.rtde.api.sample import Sample
    from gatewayd.rtde.api.stream import BoundedStream
    from gatewayd.rtde.messages import ControllerVersion, TextLevel
    from gatewayd.rtde.types import DataType

__all__ = [
    "AttemptFailedEvent",
    "BoundedStream",
    "ConnectFailedError",
    "ConnectedEvent",
    "ConnectionLostError",
    "ConnectionState",
    "ControllerVersion",
    "DataType",
    "ErrorEvent",
    "FieldsRefusedError",
    "LostEvent",
    "NotVerifiedError",
    "OverflowEvent",
    "PausedEvent",
    "Properties",
    "RefusedEvent",
    "Retry",
    "Robot",
    "RobotEvent",
    "RtdeError",
    "Sample",
    "SetUpEvent",
    "StartedEvent",
    "TextEvent",
    "TextLevel",
    "TypesDifferError",
    "WriteRefusedError",
    "connect",
]

_HOMES = {
    "api.errors": (
        "ConnectFailedError",
        "ConnectionLostError",
        "FieldsRefusedError",
        "NotVerifiedError",
        "RtdeError",
        "TypesDifferError",
        "WriteRefusedError",
    ),
    "api.events": (
        "AttemptFailedEvent",
        "ConnectedEvent",
        "ErrorEvent",
        "LostEvent",
        "OverflowEvent",
        "PausedEvent",
        "RefusedEvent",
        "RobotEvent",
        "SetUpEvent",
        "StartedEvent",
        "TextEvent",
    ),
    "api.feed": ("ConnectionState",),
    "api.properties": ("Properties",),
    "api.retry": ("Retry",),
    "api.robot": ("Robot", "connect"),
    "api.sample": ("Sample",),
    "api.stream": ("BoundedStream",),
    "messages": ("ControllerVersion", "TextLevel"),
    "types": ("DataType",),
}
_MODULES = ("enums", "fields", "recipes", "recording", "sync", "testing")
"""Modules that `rtde.NAME` imports likewise."""
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name in _MODULES:
            return import_module(f"{__name__}.{name}")
        home = _HOME_OF.get(name)
        if home is None:
            message = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(message)
        value = getattr(import_module(f"{__name__}.{home}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
