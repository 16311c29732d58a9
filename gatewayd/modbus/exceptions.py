"""Exception codes: why a request is not answered with data (Application Protocol V1.1b3, 7)."""

from __future__ import annotations

from enum import IntEnum

NAMES = {
    0x01: "illegal function",
    0x02: "illegal data address",
    0x03: "illegal data value",
    0x04: "server device failure",
    0x05: "acknowledge",
    0x06: "server device busy",
    0x08: "memory parity error",
    0x0A: "gateway path unavailable",
    0x0B: "gateway target device failed to respond",
}
"""All that there are, as the specification names them."""


class ExceptionCode(IntEnum):
    """Those in use."""

    ILLEGAL_FUNCTION = 0x01
    ILLEGAL_ADDRESS = 0x02
    ILLEGAL_VALUE = 0x03
    DEVICE_FAILURE = 0x04
    BUSY = 0x06
    PATH_UNAVAILABLE = 0x0A
    TARGET_FAILED = 0x0B

    @property
    def text(self) -> str:
        """Its name in words: `illegal function`."""
        return NAMES[self]
