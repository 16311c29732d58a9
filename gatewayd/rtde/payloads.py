"""The payload of each package type, both directions, protocol versions 1 and 2 (guide, section "Protocol").

Tables of decoders and encoders by package and by message type. The type of a package does not show its direction, and
its layout depends on the version spoken, so there is a table for each. Where guide and controllers differ the
controllers are followed, as UR's own client libraries do: version 1 outputs carry no recipe id, a version 1 text
from the controller has neither lengths nor source.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, TypeVar

from gatewayd.report.format import counted
from gatewayd.rtde import messages
from gatewayd.rtde.messages import ControllerMessage, ExecutableMessage, PackageType, TextMessage

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    ControllerDecoders = Mapping[int, Callable[[bytes], ControllerMessage]]
    ExecutableDecoders = Mapping[int, Callable[[bytes], ExecutableMessage]]

_UINT16 = struct.Struct(">H")
_VERSION = struct.Struct(">4I")
_DOUBLE = struct.Struct(">d")
_MAX_TEXT = 0xFF
_LEVELS = frozenset(messages.TextLevel)
_CONTROLS = frozenset(range(32)) - frozenset(b"\t\n\r")
"""Bytes that no text has, but the lengths and levels of version 2."""

_Message = TypeVar("_Message", bound="ControllerMessage | ExecutableMessage")


class MalformedPayloadError(Exception):
    """A payload that does not fit its layout; `read_as` is the message that it makes all the same, if it makes one."""

    def __init__(self, reason: str, read_as: ControllerMessage | ExecutableMessage | None = None) -> None:
        super().__init__(reason)
        self.read_as = read_as


def _at_least(payload: bytes, size: int) -> None:
    if len(payload) < size:
        msg = f"payload of {counted(len(payload), 'byte')}, at least {size} expected"
        raise MalformedPayloadError(msg)


def _fixed(size: int, decode: Callable[[bytes], _Message]) -> Callable[[bytes], _Message]:
    """Decoder of a payload of fixed size; newer software may append to it: what is known of a longer one is read."""

    def decode_fixed(payload: bytes) -> _Message:
        if len(payload) == size:
            return decode(payload)
        msg = f"payload of {counted(len(payload), 'byte')}, {size} expected"
        raise MalformedPayloadError(msg, decode(payload[:size]) if len(payload) > size else None)

    return decode_fixed


def _text(data: bytes) -> str:
    """Text as the controller sent it, whatever it is; bytes that are not UTF-8 stay visible as hexadecimal escapes."""
    return data.decode("utf-8", "backslashreplace")


def _names(data: bytes) -> tuple[str, ...]:
    """Split a comma separated list; ur_rtde sends one comma more at its end."""
    names = _text(data).split(",")
    if not names[-1]:
        names.pop()
    return tuple(names)


def _joined(names: tuple[str, ...]) -> bytes:
    return ",".join(names).encode("utf-8", "backslashreplace")


def _decode_text(payload: bytes) -> TextMessage:
    end = 1 + payload[0] if payload else 0
    if end >= len(payload):
        msg = f"message length {end - 1} reaches beyond the package" if payload else "no payload"
        raise MalformedPayloadError(msg, _as_v1(payload))
    level = end + 1 + payload[end]
    if level >= len(payload):
        msg = f"source length {payload[end]} does not fit the package"
        raise MalformedPayloadError(msg, _as_v1(payload))
    text = TextMessage(_text(payload[1:end]), _text(payload[end + 1 : level]), payload[level])
    if level + 1 != len(payload):
        msg = f"{counted(len(payload) - level - 1, 'byte')} after the level"
        raise MalformedPayloadError(msg, _as_v1(payload) or text)
    return text


def _as_v1(payload: bytes) -> TextMessage | None:
    """A text that came in the layout of version 1 although version 2 was agreed; None if it cannot be one."""
    can_be = payload and payload[0] in _LEVELS and _CONTROLS.isdisjoint(payload[1:])
    return _decode_text_v1(payload) if can_be else None


def _decode_text_v1(payload: bytes) -> TextMessage:
    _at_least(payload, 1)
    return TextMessage(_text(payload[1:]), "", payload[0])


def _decode_data(payload: bytes) -> messages.DataPackage:
    _at_least(payload, 1)
    return messages.DataPackage(payload[0], payload[1:])


def _decode_setup_outputs(payload: bytes) -> messages.SetupOutputs:
    _at_least(payload, _DOUBLE.size)
    return messages.SetupOutputs(_names(payload[_DOUBLE.size :]), *_DOUBLE.unpack_from(payload))


def _setup_reply(reply: Callable[[int, tuple[str, ...]], _Message]) -> Callable[[bytes], _Message]:
    """Decoder of a recipe id and a list of types; without the id it is a refusal."""

    def decode(payload: bytes) -> _Message:
        if not payload:
            raise MalformedPayloadError("no recipe id", reply(0, ()))
        return reply(payload[0], _names(payload[1:]))

    return decode


def _decode_properties(payload: bytes) -> messages.PropertiesReply:
    _at_least(payload, _UINT16.size)
    end = _UINT16.size + _UINT16.unpack_from(payload)[0]
    if end > len(payload):
        msg = f"types of {counted(end - _UINT16.size, 'byte')} reach beyond the package"
        raise MalformedPayloadError(msg)
    return messages.PropertiesReply(_names(payload[_UINT16.size : end]), payload[end:])


def _acceptance(reply: Callable[[bool], _Message]) -> Callable[[bytes], _Message]:
    """Decoder of one byte that accepts or refuses."""
    return _fixed(1, lambda payload: reply(payload[0] != 0))


def _bare(request: _Message) -> Callable[[bytes], _Message]:
    """Decoder of a request without a payload."""
    return _fixed(0, lambda _: request)


_controller_version = _fixed(
    _VERSION.size, lambda payload: messages.ControllerVersion(*_VERSION.unpack(payload))
)
_request_version = _fixed(
    _UINT16.size, lambda payload: messages.RequestProtocolVersion(*_UINT16.unpack(payload))
)


FROM_CONTROLLER: ControllerDecoders = {
    PackageType.REQUEST_PROTOCOL_VERSION: _acceptance(messages.ProtocolVersionReply),
    PackageType.GET_URCONTROL_VERSION: _controller_version,
    PackageType.TEXT_MESSAGE: _decode_text,
    PackageType.DATA_PACKAGE: _decode_data,
    PackageType.SETUP_OUTPUTS: _setup_reply(messages.OutputsSetup),
    PackageType.SETUP_INPUTS: _setup_reply(messages.InputsSetup),
    PackageType.START: _acceptance(messages.StartReply),
    PackageType.PAUSE: _acceptance(messages.PauseReply),
    PackageType.READ_PROPERTIES: _decode_properties,
}
"""Package type -> decoder of what a controller sends in protocol version 2."""
FROM_CONTROLLER_V1: ControllerDecoders = {
    **FROM_CONTROLLER,
    PackageType.TEXT_MESSAGE: _decode_text_v1,
    PackageType.DATA_PACKAGE: lambda payload: messages.DataPackage(None, payload),
    PackageType.SETUP_OUTPUTS: lambda payload: messages.OutputsSetup(None, _names(payload)),
}
"""The same in protocol version 1."""
FROM_EXECUTABLE: ExecutableDecoders = {
    PackageType.REQUEST_PROTOCOL_VERSION: _request_version,
    PackageType.GET_URCONTROL_VERSION: _bare(messages.GetControllerVersion()),
    PackageType.TEXT_MESSAGE: _decode_text,
    PackageType.DATA_PACKAGE: _decode_data,
    PackageType.SETUP_OUTPUTS: _decode_setup_outputs,
    PackageType.SETUP_INPUTS: lambda payload: messages.SetupInputs(_names(payload)),
    PackageType.START: _bare(messages.Start()),
    PackageType.PAUSE: _bare(messages.Pause()),
    PackageType.READ_PROPERTIES: lambda payload: messages.ReadProperties(_names(payload)),
}
"""Package type -> decoder of what a client sends in protocol version 2."""
FROM_EXECUTABLE_V1: ExecutableDecoders = {
    **FROM_EXECUTABLE,
    PackageType.SETUP_OUTPUTS: lambda payload: messages.SetupOutputs(_names(payload)),
}
"""The same in protocol version 1."""


def _encode_text(message: TextMessage) -> bytes:
    text = message.message.encode("utf-8", "backslashreplace")[:_MAX_TEXT]
    source = message.source.encode("utf-8", "backslashreplace")[:_MAX_TEXT]
    return bytes((len(text),)) + text + bytes((len(source),)) + source + bytes((message.level,))


def _recipe(recipe: int | None) -> bytes:
    if recipe is None:
        msg = "a recipe id belongs in this package"
        raise ValueError(msg)
    return bytes((recipe,))


def encode_executable(message: ExecutableMessage, version: int) -> tuple[PackageType, bytes]:
    """Package type and payload of what a client sends.

    Texts are cut to 255 bytes. ValueError for what the version cannot say: no recipe id, no frequency.
    """
    match message:
        case messages.DataPackage(recipe, payload):
            return PackageType.DATA_PACKAGE, _recipe(recipe) + payload
        case messages.RequestProtocolVersion(requested):
            return PackageType.REQUEST_PROTOCOL_VERSION, _UINT16.pack(requested)
        case messages.GetControllerVersion():
            return PackageType.GET_URCONTROL_VERSION, b""
        case TextMessage():
            return PackageType.TEXT_MESSAGE, _encode_text(message)
        case messages.SetupOutputs(names, frequency):
            return PackageType.SETUP_OUTPUTS, _frequency(frequency, version) + _joined(names)
        case messages.SetupInputs(names):
            return PackageType.SETUP_INPUTS, _joined(names)
        case messages.Start():
            return PackageType.START, b""
        case messages.Pause():
            return PackageType.PAUSE, b""
        case messages.ReadProperties(names):
            return PackageType.READ_PROPERTIES, _joined(names)


def _frequency(frequency: float | None, version: int) -> bytes:
    if version == 1:
        return b""
    if frequency is None:
        msg = "protocol version 2 wants an output frequency"
        raise ValueError(msg)
    return _DOUBLE.pack(frequency)


def encode_controller(message: ControllerMessage, version: int) -> tuple[PackageType, bytes]:
    """Package type and payload of what a controller sends.

    Version 1 has no place for recipe ids of outputs and for the source of a text: they are left out. Texts are cut
    to what fits. ValueError for a missing recipe id in version 2.
    """
    match message:
        case messages.DataPackage(recipe, payload):
            return PackageType.DATA_PACKAGE, payload if version == 1 else _recipe(recipe) + payload
        case messages.ControllerVersion(major, minor, bugfix, build):
            return PackageType.GET_URCONTROL_VERSION, _VERSION.pack(major, minor, bugfix, build)
        case TextMessage(text, _, level):
            if version == 1:
                return PackageType.TEXT_MESSAGE, bytes((level,)) + text.encode("utf-8", "backslashreplace")
            return PackageType.TEXT_MESSAGE, _encode_text(message)
        case messages.OutputsSetup(recipe, types):
            return PackageType.SETUP_OUTPUTS, (b"" if version == 1 else _recipe(recipe)) + _joined(types)
        case messages.InputsSetup(recipe, types):
            return PackageType.SETUP_INPUTS, _recipe(recipe) + _joined(types)
        case (
            messages.ProtocolVersionReply(accepted)
            | messages.StartReply(accepted)
            | messages.PauseReply(accepted)
        ):
            return messages.ANSWER_TYPES[type(message)], bytes((accepted,))
        case messages.PropertiesReply(types, values):
            words = _joined(types)
            return PackageType.READ_PROPERTIES, _UINT16.pack(len(words)) + words + values
