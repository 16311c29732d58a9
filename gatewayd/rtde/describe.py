"""RTDE in words: what is said in either direction, from the bytes of a connection (guide, section "Protocol").

Pure, and total: any bytes have a description. A trace may begin in the middle of a connection, so the protocol version
is not known: what can be read by version 2 is, then by version 1.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from gatewayd.rtde import messages, payloads
from gatewayd.rtde.messages import PackageType, TextLevel

_HEADER = struct.Struct(">HB")
_KINDS = frozenset(PackageType)
_SHOWN = 6
"""Names of one list in one line."""
_BYTES = 16


class MessageStream:
    """Cuts one direction of a connection into packages; where it is joined in the middle it waits for a beginning."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """The packages that are complete, with their headers. What cannot be cut comes as it is."""
        data = self._rest + data
        self._rest = b""
        position = 0
        while len(data) - position >= _HEADER.size:
            size, kind = _HEADER.unpack_from(data, position)
            if size < _HEADER.size or (kind not in _KINDS and not 0x20 <= kind < 0x7F):
                yield data[position:]
                return
            if len(data) - position < size:
                break
            yield data[position : position + size]
            position += size
        self._rest = data[position:]


def package_text(package: bytes, *, from_controller: bool) -> str:
    """One package: `set up outputs at 500 Hz: timestamp, actual_q and 38 more`."""
    if len(package) < _HEADER.size:
        return _bytes(package)
    size, kind = _HEADER.unpack_from(package)
    payload = package[_HEADER.size :]
    if kind not in _KINDS or size != len(package):
        return f"unknown package, type {kind}, {_bytes(payload)}"
    found = _decoded(PackageType(kind), payload, from_controller=from_controller)
    return (
        f"{PackageType(kind).name.lower().replace('_', ' ')} {_bytes(payload)}"
        if found is None
        else _text(found)
    )


def _decoded(kind: PackageType, payload: bytes, *, from_controller: bool) -> object | None:
    controller = (payloads.FROM_CONTROLLER, payloads.FROM_CONTROLLER_V1)
    executable = (payloads.FROM_EXECUTABLE, payloads.FROM_EXECUTABLE_V1)
    for table in controller if from_controller else executable:
        try:
            return table[kind](payload)
        except (payloads.MalformedPayloadError, ValueError, struct.error, IndexError):
            continue
    return None


def _text(message: object) -> str:
    match message:
        case messages.DataPackage(recipe, payload):
            named = "" if recipe is None else f" of recipe {recipe}"
            return f"data{named}, {len(payload)} bytes"
        case messages.TextMessage(text, source, level):
            known = TextLevel(level).name.lower() if level in set(TextLevel) else f"level {level}"
            return f"text ({known})" + (f" of {source}" if source else "") + f": {text}"
        case messages.SetupOutputs(names, frequency):
            return "set up outputs" + (f" at {frequency:g} Hz" if frequency else "") + f": {_list(names)}"
        case messages.SetupInputs(names):
            return f"set up inputs: {_list(names)}"
        case messages.OutputsSetup(recipe, types):
            return f"outputs set up{_recipe(recipe)}: {_list(types)}"
        case messages.InputsSetup(recipe, types):
            return f"inputs set up{_recipe(recipe)}: {_list(types)}"
        case messages.RequestProtocolVersion(version):
            return f"request protocol version {version}"
        case messages.ControllerVersion():
            return f"controller version {message}"
        case (
            messages.ProtocolVersionReply(accepted)
            | messages.StartReply(accepted)
            | messages.PauseReply(accepted)
        ):
            return f"{_ANSWERED[type(message)]} {'accepted' if accepted else 'refused'}"
    return _BARE[type(message)]


_ANSWERED: dict[type, str] = {
    messages.ProtocolVersionReply: "protocol version",
    messages.StartReply: "start",
    messages.PauseReply: "pause",
}
_BARE: dict[type, str] = {
    messages.GetControllerVersion: "ask for the controller's version",
    messages.Start: "start",
    messages.Pause: "pause",
}


def _recipe(recipe: int | None) -> str:
    return "" if recipe is None else f", recipe {recipe}" if recipe else ", refused"


def _list(names: tuple[str, ...]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")


def _bytes(data: bytes) -> str:
    return f"{len(data)} bytes: {data[:_BYTES].hex(' ')}" + (" ..." if len(data) > _BYTES else "")
