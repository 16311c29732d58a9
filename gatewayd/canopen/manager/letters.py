"""How the boot of a device can fail: the letters of CiA 302-2 ("boot slave process", error status) and their words."""

from __future__ import annotations

from enum import Enum


class BootError(Enum):
    """The value is the letter. F, G and I cannot happen here: nothing is guarded, and no program is downloaded."""

    UNDECLARED = "A"
    NO_ANSWER = "B"
    DEVICE_TYPE = "C"
    VENDOR = "D"
    HEARTBEAT = "E"
    GUARDING = "F"
    PROGRAM = "G"
    SOFTWARE = "H"
    SOFTWARE_DOWNLOAD = "I"
    CONFIGURATION = "J"
    HEARTBEAT_START = "K"
    OPERATIONAL = "L"
    PRODUCT = "M"
    REVISION = "N"
    SERIAL = "O"

    @property
    def words(self) -> str:
        """What it means."""
        return _WORDS[self]

    @property
    def is_failure(self) -> bool:
        """Whether the device is not in use because of it; L only says how it was found."""
        return self is not BootError.OPERATIONAL


_WORDS = {
    BootError.UNDECLARED: "the device is not declared",
    BootError.NO_ANSWER: "no answer",
    BootError.DEVICE_TYPE: "another device type",
    BootError.VENDOR: "another vendor",
    BootError.HEARTBEAT: "heartbeat lost",
    BootError.GUARDING: "node guarding lost",
    BootError.PROGRAM: "program download not configured",
    BootError.SOFTWARE: "another software version",
    BootError.SOFTWARE_DOWNLOAD: "program download failed",
    BootError.CONFIGURATION: "configuration failed",
    BootError.HEARTBEAT_START: "no heartbeat after it was set up",
    BootError.OPERATIONAL: "was already operational",
    BootError.PRODUCT: "another product",
    BootError.REVISION: "another revision",
    BootError.SERIAL: "another serial number",
}
