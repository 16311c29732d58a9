"""What the kernel knows of a network interface that is a CAN controller, asked over rtnetlink.

Reading needs no privilege. A service that may not use AF_NETLINK cannot know why its bus is silent, so its unit has to
allow it (RestrictAddressFamilies=).
"""

from __future__ import annotations

import errno
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from itertools import count

from gatewayd.canopen.bus import BusError


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


# linux/netlink.h, linux/rtnetlink.h, linux/if_link.h, linux/can/netlink.h
_HEADER = struct.Struct("=IHHII")
_LINK = struct.Struct("=BxHiII")
_ATTRIBUTE = struct.Struct("=HH")
_WORD = struct.Struct("=I")
_ERROR = struct.Struct("=i")
_PAIR = struct.Struct("=HH")
_NLMSG_ERROR, _RTM_NEWLINK, _RTM_GETLINK, _NLM_F_REQUEST = 2, 16, 18, 1
_IFLA_IFNAME, _IFLA_LINKINFO, _IFLA_CARRIER = 3, 18, 33
_IFLA_INFO_DATA = 2
_IFLA_CAN_BITTIMING, _IFLA_CAN_STATE, _IFLA_CAN_RESTART_MS, _IFLA_CAN_BERR_COUNTER = 1, 4, 6, 8
_ARPHRD_CAN, _IFF_UP = 280, 1
_TYPE_MASK = 0x3FFF
_MAX_REPLY = 32768


def request(name: str, sequence: int) -> bytes:
    """What the kernel is asked for an interface."""
    text = name.encode() + b"\0"
    attribute = _ATTRIBUTE.pack(_ATTRIBUTE.size + len(text), _IFLA_IFNAME) + text + bytes(-len(text) % 4)
    length = _HEADER.size + _LINK.size + len(attribute)
    header = _HEADER.pack(length, _RTM_GETLINK, _NLM_F_REQUEST, sequence, 0)
    return header + _LINK.pack(socket.AF_UNSPEC, 0, 0, 0, 0) + attribute


def parse(reply: bytes, sequence: int) -> Interface | None:
    """The answer: None if there is no such interface. OSError if it is another refusal.

    ValueError if it is the answer to another question.
    """
    _, kind, _, answered, _ = _HEADER.unpack_from(reply)
    if answered != sequence:
        raise ValueError(f"answer {answered} to question {sequence}")
    if kind == _NLMSG_ERROR:
        number = -_ERROR.unpack_from(reply, _HEADER.size)[0]
        if number == errno.ENODEV:
            return None
        raise OSError(number, "the kernel does not describe the interface")
    _, hardware, index, flags, _ = _LINK.unpack_from(reply, _HEADER.size)
    found = dict(_attributes(reply[_HEADER.size + _LINK.size :]))
    details = dict(_attributes(dict(_attributes(found.get(_IFLA_LINKINFO, b""))).get(_IFLA_INFO_DATA, b"")))
    is_can = hardware == _ARPHRD_CAN
    state = _word(details.get(_IFLA_CAN_STATE)) if is_can else None
    errors = details.get(_IFLA_CAN_BERR_COUNTER) if is_can else None
    tx_errors, rx_errors = _PAIR.unpack_from(errors) if errors else (None, None)
    return Interface(
        index,
        is_can,
        bool(flags & _IFF_UP),
        found.get(_IFLA_CARRIER, b"\1")[:1] != b"\0",
        ControllerState(state) if state is not None and state <= ControllerState.SLEEPING else None,
        _word(details.get(_IFLA_CAN_BITTIMING)) or None if is_can else None,
        _word(details.get(_IFLA_CAN_RESTART_MS)) if is_can else None,
        tx_errors,
        rx_errors,
    )


def _attributes(data: bytes) -> Iterator[tuple[int, bytes]]:
    place = 0
    while place + _ATTRIBUTE.size <= len(data):
        length, kind = _ATTRIBUTE.unpack_from(data, place)
        if length < _ATTRIBUTE.size:
            return
        yield kind & _TYPE_MASK, data[place + _ATTRIBUTE.size : place + length]
        place += (length + 3) & ~3


def _word(data: bytes | None) -> int | None:
    return int(_WORD.unpack_from(data)[0]) if data and len(data) >= _WORD.size else None


class InterfaceReader:
    """A socket to the kernel, kept open: one look costs some 20 us. BusError if the sandbox forbids it."""

    def __init__(self) -> None:
        try:
            self._socket = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE)
        except OSError as error:
            raise BusError(
                f"cannot ask the kernel for CAN interfaces: {error.strerror}; allow AF_NETLINK "
                "(in a systemd unit: RestrictAddressFamilies=)"
            ) from error
        self._socket.setblocking(False)
        self._sequence = count(1)

    def read(self, name: str) -> Interface | None:
        """The interface as it is now; None if there is none of that name."""
        sequence = next(self._sequence) & 0xFFFFFFFF
        self._socket.sendto(request(name, sequence), (0, 0))
        while True:
            try:  # the kernel has answered before sendto returns
                return parse(self._socket.recv(_MAX_REPLY), sequence)
            except ValueError:
                continue

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()
