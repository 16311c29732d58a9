"""RTDE in words: what is said in either direction, from the bytes of a connection (guide, section "Protocol").

Pure, and total: any bytes have a description. A trace may begin in the middle of a connection, so the protocol version
is not known: what can be read by version 2 is, then by version 1.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from gatewayd.report.format import counted
from gatewayd.rtde import messages, payloads
from gatewayd.rtde.messages import PackageType, TextLevel
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

_HEADER = struct.Struct(">HB")
_KINDS = frozenset(PackageType)
_SHOWN = 6
"""Names of one list in one line."""
_BYTES = 16


class Recipes:
    """The recipes of one connection, as far as its set-up was seen: they say what is in data packages."""

    def __init__(self) -> None:
        self._asked: dict[PackageType, tuple[str, ...]] = {}
        self._known: dict[tuple[bool, int | None], Recipe] = {}

    def note(self, message: object, *, from_controller: bool) -> str:
        """Learn from a message of the set-up; of data the first values, `timestamp = 12.5, ...`, if they are known."""
        match message:
            case messages.SetupOutputs(names, _):
                self._asked[PackageType.SETUP_OUTPUTS] = names
            case messages.SetupInputs(names):
                self._asked[PackageType.SETUP_INPUTS] = names
            case messages.OutputsSetup(recipe, types):
                self._learn(PackageType.SETUP_OUTPUTS, recipe, types)
            case messages.InputsSetup(recipe, types):
                self._learn(PackageType.SETUP_INPUTS, recipe, types)
            case messages.DataPackage(number, payload):
                known = self._known.get((from_controller, number))
                if known is not None and known.size == len(payload):
                    return _values(known, payload)
        return ""

    def _learn(self, kind: PackageType, number: int | None, types: tuple[str, ...]) -> None:
        key, names = (kind is PackageType.SETUP_OUTPUTS, number), self._asked.get(kind, ())
        self._known.pop(key, None)
        if len(names) == len(types) and all(word in DataType.__members__ for word in types):
            self._known[key] = Recipe(names, [DataType.from_word(word) for word in types])


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


def package_text(package: bytes, recipes: Recipes | None = None, *, from_controller: bool) -> str:
    """One package: `set up outputs at 500 Hz: timestamp, actual_q and 38 more`. `recipes`: those of its connection."""
    if len(package) < _HEADER.size:
        return _bytes(package)
    size, kind = _HEADER.unpack_from(package)
    payload = package[_HEADER.size :]
    if kind not in _KINDS or size != len(package):
        return f"unknown package, type {kind}, {_bytes(payload)}"
    found = _decoded(PackageType(kind), payload, from_controller=from_controller)
    if found is None:
        return f"{PackageType(kind).name.lower().replace('_', ' ')} {_bytes(payload)}"
    values = recipes.note(found, from_controller=from_controller) if recipes is not None else ""
    return _text(found) + (f": {values}" if values else "")


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
            return f"data{named}, {counted(len(payload), 'byte')}"
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
    return _BARE.get(type(message)) or _properties_text(message)


def _properties_text(message: object) -> str:
    match message:
        case messages.ReadProperties(names):
            return f"read properties: {_list(names)}"
        case messages.PropertiesReply(types, values):
            return f"properties of types {_list(types)}, {counted(len(values), 'byte')} of values"
    raise TypeError(message)


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


def _values(recipe: Recipe, payload: bytes) -> str:
    flat = recipe.unpack(payload)
    shown = [
        f"{name} = {' '.join(f'{value:g}' for value in flat[recipe.slots[name]])}"
        for name in recipe.names[:_SHOWN]
    ]
    return _list((*shown, *recipe.names[_SHOWN:]))


def _recipe(recipe: int | None) -> str:
    return "" if recipe is None else f", recipe {recipe}" if recipe else ", refused"


def _list(names: tuple[str, ...]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")


def _bytes(data: bytes) -> str:
    return (
        counted(len(data), "byte")
        + (f": {data[:_BYTES].hex(' ')}" if data else "")
        + (" ..." if len(data) > _BYTES else "")
    )
