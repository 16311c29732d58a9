"""Error frames of SocketCAN: what a CAN controller reports of itself and the wire (linux/can/error.h)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag


class ErrorClass(IntFlag):
    """What an error frame is about; bits of its identifier."""

    TX_TIMEOUT = 0x001
    LOST_ARBITRATION = 0x002
    CONTROLLER = 0x004
    PROTOCOL = 0x008
    TRANSCEIVER = 0x010
    NO_ACKNOWLEDGE = 0x020
    BUS_OFF = 0x040
    BUS_ERROR = 0x080
    RESTARTED = 0x100
    COUNTERS = 0x200


class ControllerFlags(IntFlag):
    """State of the controller; byte 1."""

    RX_OVERFLOW = 0x01
    TX_OVERFLOW = 0x02
    RX_WARNING = 0x04
    TX_WARNING = 0x08
    RX_PASSIVE = 0x10
    TX_PASSIVE = 0x20
    ACTIVE = 0x40


class Violation(IntFlag):
    """How the protocol was violated; byte 2."""

    SINGLE_BIT = 0x01
    FORM = 0x02
    STUFFING = 0x04
    DOMINANT_BIT = 0x08
    RECESSIVE_BIT = 0x10
    OVERLOAD = 0x20
    ACTIVE_ERROR = 0x40
    WHILE_SENDING = 0x80


@dataclass(frozen=True, slots=True)
class ErrorFrame:
    """One error frame, decoded."""

    classes: ErrorClass
    controller: ControllerFlags
    violation: Violation
    tx_errors: int | None
    """Transmit error counter, where the driver reports it."""
    rx_errors: int | None

    def __str__(self) -> str:
        words = [_spell(self.classes & ~ErrorClass.COUNTERS), _spell(self.controller), _spell(self.violation)]
        if self.tx_errors is not None:
            words.append(f"transmit errors: {self.tx_errors}, receive errors: {self.rx_errors}")
        return ", ".join(word for word in words if word) or "error frame"


def _spell(flags: IntFlag) -> str:
    return ", ".join(flag.name.lower().replace("_", " ") for flag in flags if flag.name)


def decode(can_id: int, data: bytes) -> ErrorFrame:
    """An error frame by its identifier (the error flag may be set) and its up to eight bytes."""
    bytes_ = data.ljust(8, b"\0")
    classes = ErrorClass(can_id & 0x3FF)
    controller = bytes_[1] & 0x7F if classes & ErrorClass.CONTROLLER else 0
    violation = bytes_[2] if classes & ErrorClass.PROTOCOL else 0
    # Kernels before 5.19 fill in the counters of controller frames without announcing them.
    counted = classes & ErrorClass.COUNTERS or (classes & ErrorClass.CONTROLLER and any(bytes_[6:8]))
    tx_errors, rx_errors = bytes_[6:8] if counted else (None, None)
    return ErrorFrame(classes, ControllerFlags(controller), Violation(violation), tx_errors, rx_errors)
