"""EMCY messages of devices in words: error code, error register, manufacturer's bytes (CiA 301, 7.2.7 and table 26).

The codes are those of CiA 301 and the common ones of drives (CiA 402). A code that is not listed is named by its class.
"""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.canopen.emergency import Register

_CODES = {
    0x0000: "no error",
    0x2310: "current at outputs too high (overload)",
    0x2320: "short circuit at outputs",
    0x2330: "load dump at outputs",
    0x3110: "mains voltage too high",
    0x3120: "mains voltage too low",
    0x3130: "mains phase failure",
    0x3210: "DC link voltage too high",
    0x3220: "DC link voltage too low",
    0x4210: "device temperature too high",
    0x4310: "drive temperature too high",
    0x6010: "software reset (watchdog)",
    0x7121: "motor blocked",
    0x7305: "incremental encoder 1 fault",
    0x7500: "communication",
    0x8110: "CAN overrun: messages lost",
    0x8120: "CAN in error-passive mode",
    0x8130: "life guarding or heartbeat error",
    0x8140: "recovered from bus-off",
    0x8150: "CAN-ID collision",
    0x8210: "PDO not processed: too short",
    0x8220: "PDO longer than its mapping",
    0x8230: "DAM MPDO not processed: no such object",
    0x8240: "SYNC of unexpected length",
    0x8250: "RPDO timed out",
    0x8611: "following error",
    0x8612: "reference limit",
}
_GROUPS = {
    0x10: "generic error",
    0x20: "current",
    0x21: "current, input side",
    0x22: "current inside the device",
    0x23: "current, output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the device",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x43: "drive temperature",
    0x44: "supply temperature",
    0x50: "device hardware",
    0x60: "device software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "data set",
    0x70: "additional modules",
    0x71: "power module",
    0x72: "measurement",
    0x73: "sensor",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol error",
    0x83: "torque control",
    0x84: "velocity control",
    0x86: "positioning",
    0x90: "external error",
    0xF0: "additional functions",
    0xFF: "of the manufacturer",
}
_REGISTER = {
    Register.CURRENT: "current",
    Register.VOLTAGE: "voltage",
    Register.TEMPERATURE: "temperature",
    Register.COMMUNICATION: "communication",
    Register.PROFILE: "device profile",
    Register.MANUFACTURER: "manufacturer",
}
_LENGTH = 8


@dataclass(frozen=True, slots=True)
class EmergencyMessage:
    """What one EMCY frame says."""

    code: int
    register: int
    manufacturer: bytes
    """Five bytes."""

    @property
    def is_reset(self) -> bool:
        """Whether it says that an error has gone (00xxh)."""
        return self.code < 0x0100

    def __str__(self) -> str:
        parts = [f"{self.code:04X}h {code_text(self.code)}"]
        bits = register_text(self.register)
        if bits:
            parts.append(f"error register {self.register:02X}h ({bits})")
        if any(self.manufacturer):
            parts.append(f"manufacturer {self.manufacturer.hex(' ')}")
        return ", ".join(parts)


def read_emergency(data: bytes) -> EmergencyMessage | None:
    """The message in the bytes of a frame; None if they are not eight."""
    if len(data) != _LENGTH:
        return None
    return EmergencyMessage(int.from_bytes(data[:2], "little"), data[2], bytes(data[3:]))


def code_text(code: int) -> str:
    """An error code in words; never empty."""
    exact = _CODES.get(code)
    if exact is not None:
        return exact
    group = _GROUPS.get(code >> 8) or _GROUPS.get(code >> 8 & 0xF0)
    return group or ("error reset or no error" if code < 0x0100 else "unknown error")


def register_text(register: int) -> str:
    """The bits of an error register (1001h) in words, without the generic one; empty if there are none."""
    return ", ".join(words for bit, words in _REGISTER.items() if register & bit)
