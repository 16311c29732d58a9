"""What a unit says of itself.

Read Device Identification, function 43 with MEI type 14 (V1.1b3, 6.21), and Report Server ID, function 17 (6.13).
"""

from __future__ import annotations

from enum import IntEnum

from gatewayd import __version__
from gatewayd.modbus.frames import MAX_PDU

FUNCTION = 43
REPORT_SERVER_ID = 17
MEI_TYPE = 14

_HEAD_SIZE = 7
_OBJECT_HEAD_SIZE = 2
_MAX_OBJECT = MAX_PDU - _HEAD_SIZE - _OBJECT_HEAD_SIZE
_REQUEST_SIZE = 4
_MORE_FOLLOWS = 0xFF
_RUNNING, _NOT_RUNNING = 0xFF, 0x00
_CONFORMITY = 0x83
"""Extended identification, as a stream and object by object."""


class ReadCode(IntEnum):
    """How much is asked for."""

    BASIC = 1
    REGULAR = 2
    EXTENDED = 3
    INDIVIDUAL = 4


class ObjectId(IntEnum):
    """Objects we have; from 0x80 on they are our own."""

    VENDOR_NAME = 0x00
    PRODUCT_CODE = 0x01
    REVISION = 0x02
    VENDOR_URL = 0x03
    PRODUCT_NAME = 0x04
    MODEL_NAME = 0x05
    APPLICATION_NAME = 0x06
    FINGERPRINT = 0x80


_LAST_OF: dict[int, int] = {ReadCode.BASIC: 0x02, ReadCode.REGULAR: 0x7F, ReadCode.EXTENDED: 0xFF}


class Identification:
    """The identification objects of one unit."""

    def __init__(self, cell: str, fingerprint: int, application: str = "") -> None:
        """`cell` is the model name; `fingerprint`, in hexadecimal, says which mapping is loaded."""
        texts: dict[int, str] = {
            ObjectId.VENDOR_NAME: "gatewayd",
            ObjectId.PRODUCT_CODE: "gatewayd",
            ObjectId.REVISION: __version__,
            ObjectId.VENDOR_URL: "urn:gatewayd",
            ObjectId.PRODUCT_NAME: "gatewayd: robot registers on Modbus TCP",
            ObjectId.MODEL_NAME: cell,
            ObjectId.APPLICATION_NAME: application or cell,
            ObjectId.FINGERPRINT: f"{fingerprint:08x}",
        }
        self._objects = {key: text.encode("ascii", "replace")[:_MAX_OBJECT] for key, text in texts.items()}

    def answer(self, pdu: bytes) -> bytes | int:
        """The answer to a request that begins with 43, 14; or the exception code."""
        if len(pdu) != _REQUEST_SIZE:
            return 0x03
        code, first = pdu[2], pdu[3]
        if code == ReadCode.INDIVIDUAL:
            content = self._objects.get(first)
            return 0x02 if content is None else self._stream(code, [(first, content)])
        last = _LAST_OF.get(code)
        if last is None:
            return 0x03
        if first > last or first not in self._objects:
            first = 0
        return self._stream(
            code, [(key, text) for key, text in self._objects.items() if first <= key <= last]
        )

    def server_id(self, unit: int, *, running: bool) -> bytes:
        """The answer to Report Server ID: the unit id, the run indicator, then product, version and cell as text."""
        text = b" ".join(
            self._objects[key] for key in (ObjectId.PRODUCT_CODE, ObjectId.REVISION, ObjectId.MODEL_NAME)
        )
        content = bytes((unit, _RUNNING if running else _NOT_RUNNING)) + text
        content = content[: MAX_PDU - 2]
        return bytes((REPORT_SERVER_ID, len(content))) + content

    def _stream(self, code: int, objects: list[tuple[int, bytes]]) -> bytes:
        body = bytearray()
        count = more = following = 0
        for key, content in objects:
            if _HEAD_SIZE + len(body) + _OBJECT_HEAD_SIZE + len(content) > MAX_PDU:
                more, following = _MORE_FOLLOWS, key
                break
            body += bytes((key, len(content))) + content
            count += 1
        return bytes((FUNCTION, MEI_TYPE, code, _CONFORMITY, more, following, count)) + body
