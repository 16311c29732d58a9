"""What the kernel knows of a network interface that is a CAN controller, asked over rtnetlink.

Reading needs no privilege. A service that may not use AF_NETLINK cannot know why its bus is silent, so its unit has to
allow it (RestrictAddressFamilies=).
"""

from __future__ import annotations

import errno
import socket
import struct
from dataclasses import dataclass
from enum import IntEnum
from itertools import count

from gatewayd.canopen.bus import BusError
from gatewayd.machine import netlink


class ControllerState(IntEnum):
    """CAN_STATE_* of linux/can/netlink.h."""

    ACTIVE = 0
    WARNING = 1
    PASSIVE = 2
    BUS_OFF = 3
    STOPPED = 4
    SLEEPING = 5


@dataclass(frozen=True, slots=True)
class Interface:
    """One look at an interface. What its driver does not report is None."""

    index: int
    """Another one after the adapter was unplugged and plugged in again."""
    is_can: bool
    up: bool
    """Administratively: somebody brought it up."""
    carrier: bool
    """False while the controller is off the bus."""
    controller: ControllerState | None = None
    bitrate: int | None = None
    restart_ms: int | None = None
    """Wait before the kernel restarts a controller that went bus-off; 0: it never does."""
    tx_errors: int | None = None
    rx_errors: int | None = None


# linux/rtnetlink.h, linux/if_link.h, linux/can/netlink.h
_LINK = struct.Struct("=BxHiII")
_PAIR = struct.Struct("=HH")
_RTM_GETLINK = 18
_IFLA_IFNAME, _IFLA_LINKINFO, _IFLA_CARRIER = 3, 18, 33
_IFLA_INFO_DATA = 2
_IFLA_CAN_BITTIMING, _IFLA_CAN_STATE, _IFLA_CAN_RESTART_MS, _IFLA_CAN_BERR_COUNTER = 1, 4, 6, 8
_ARPHRD_CAN, _IFF_UP = 280, 1


def request(name: str, sequence: int) -> bytes:
    """What the kernel is asked for an interface."""
    link = _LINK.pack(socket.AF_UNSPEC, 0, 0, 0, 0)
    return netlink.question(
        _RTM_GETLINK, link + netlink.attribute(_IFLA_IFNAME, name.encode() + b"\0"), sequence
    )


def parse(reply: bytes, sequence: int) -> Interface | None:
    """The answer: None if there is no such interface. OSError if it is another refusal.

    ValueError if it is the answer to another question.
    """
    answer = netlink.answer(reply)
    if answer.sequence != sequence:
        raise ValueError(f"answer {answer.sequence} to question {sequence}")
    if answer.error == errno.ENODEV:
        return None
    if answer.error:
        raise OSError(answer.error, "the kernel does not describe the interface")
    _, hardware, index, flags, _ = _LINK.unpack_from(answer.body)
    found = dict(netlink.attributes(answer.body[_LINK.size :]))
    kind = dict(netlink.attributes(found.get(_IFLA_LINKINFO, b"")))
    details = dict(netlink.attributes(kind.get(_IFLA_INFO_DATA, b"")))
    is_can = hardware == _ARPHRD_CAN
    state = netlink.word(details.get(_IFLA_CAN_STATE)) if is_can else None
    errors = details.get(_IFLA_CAN_BERR_COUNTER) if is_can else None
    tx_errors, rx_errors = _PAIR.unpack_from(errors) if errors else (None, None)
    return Interface(
        index,
        is_can,
        bool(flags & _IFF_UP),
        found.get(_IFLA_CARRIER, b"\1")[:1] != b"\0",
        ControllerState(state) if state is not None and state <= ControllerState.SLEEPING else None,
        netlink.word(details.get(_IFLA_CAN_BITTIMING)) or None if is_can else None,
        netlink.word(details.get(_IFLA_CAN_RESTART_MS)) if is_can else None,
        tx_errors,
        rx_errors,
    )


class InterfaceReader:
    """A socket to the kernel, kept open: one look costs some 20 us. BusError if the sandbox forbids it."""

    def __init__(self) -> None:
        try:
            self._socket = netlink.open_socket()
        except OSError as error:
            raise BusError(
                f"cannot ask the kernel for CAN interfaces: {error.strerror}; allow AF_NETLINK "
                "(in a systemd unit: RestrictAddressFamilies=)"
            ) from error
        self._sequence = count(1)

    def read(self, name: str) -> Interface | None:
        """The interface as it is now; None if there is none of that name."""
        sequence = next(self._sequence) & 0xFFFFFFFF
        self._socket.sendto(request(name, sequence), (0, 0))
        while True:
            try:
                return parse(self._socket.recv(netlink.MAX_REPLY), sequence)
            except ValueError:
                continue

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()
