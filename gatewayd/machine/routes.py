"""Which way packages for an address take from this machine, asked over rtnetlink; reading needs no privilege."""

from __future__ import annotations

import ipaddress
import os
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

# linux/netlink.h, linux/rtnetlink.h
_HEADER = struct.Struct("=IHHII")
_ROUTE = struct.Struct("=BBBBBBBBI")
_ATTRIBUTE = struct.Struct("=HH")
_ERROR = struct.Struct("=i")
_WORD = struct.Struct("=I")
_NLMSG_ERROR, _RTM_NEWROUTE, _RTM_GETROUTE, _NLM_F_REQUEST = 2, 24, 26, 1
_RTA_DST, _RTA_OIF, _RTA_GATEWAY, _RTA_PREFSRC = 1, 4, 5, 7
_RTN_LOCAL = 2
_TYPE_MASK = 0x3FFF
_MAX_REPLY = 32768
_INTERFACES = Path("/sys/class/net")


@dataclass(frozen=True, slots=True)
class Route:
    """How an address is reached."""

    interface: str
    source: str
    """Address of this machine that the packages come from; empty: the kernel does not say."""
    gateway: str = ""
    """Router in between; empty: none."""
    is_local: bool = False
    """It is an address of this machine."""
    has_link: bool = True
    """False: the interface is down, or nothing is plugged in."""


def route_to(address: str) -> Route:
    """The route to an IPv4 or IPv6 address. OSError if there is none, or the kernel cannot be asked."""
    target = ipaddress.ip_address(address.partition("%")[0])
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as kernel:
        kernel.setblocking(False)  # the kernel has answered before sendto returns
        kernel.sendto(request(target.packed), (0, 0))
        return parse(kernel.recv(_MAX_REPLY))


def request(packed: bytes) -> bytes:
    """What the kernel is asked for an address of four or sixteen bytes."""
    family = socket.AF_INET if len(packed) == 4 else socket.AF_INET6
    attribute = _ATTRIBUTE.pack(_ATTRIBUTE.size + len(packed), _RTA_DST) + packed
    body = _ROUTE.pack(family, 8 * len(packed), 0, 0, 0, 0, 0, 0, 0) + attribute
    return _HEADER.pack(_HEADER.size + len(body), _RTM_GETROUTE, _NLM_F_REQUEST, 1, 0) + body


def parse(reply: bytes) -> Route:
    """The kernel's answer; OSError with its reason if it is a refusal, and for what cannot be read."""
    try:
        _, kind, *_ = _HEADER.unpack_from(reply)
        if kind == _NLMSG_ERROR:
            number = -_ERROR.unpack_from(reply, _HEADER.size)[0]
            raise OSError(number, os.strerror(number))
        kind_of_route = _ROUTE.unpack_from(reply, _HEADER.size)[7]
        found = dict(_attributes(reply[_HEADER.size + _ROUTE.size :]))
        index = _WORD.unpack(found[_RTA_OIF])[0] if _RTA_OIF in found else 0
    except struct.error as error:
        raise OSError(None, "the kernel's answer cannot be read") from error
    name = _name(index)
    return Route(
        name,
        _address(found.get(_RTA_PREFSRC)),
        _address(found.get(_RTA_GATEWAY)),
        kind_of_route == _RTN_LOCAL,
        has_link(name),
    )


def has_link(interface: str) -> bool:
    """Whether the interface is up, and something is plugged in; True where the kernel does not know."""
    try:
        return (_INTERFACES / interface / "carrier").read_text("ascii").strip() != "0"
    except FileNotFoundError:
        return True
    except (OSError, ValueError):  # the kernel refuses to read it of an interface that is down
        return False


def _attributes(data: bytes) -> Iterator[tuple[int, bytes]]:
    place = 0
    while place + _ATTRIBUTE.size <= len(data):
        length, kind = _ATTRIBUTE.unpack_from(data, place)
        if length < _ATTRIBUTE.size:
            return
        yield kind & _TYPE_MASK, data[place + _ATTRIBUTE.size : place + length]
        place += (length + 3) & ~3


def _address(packed: bytes | None) -> str:
    return str(ipaddress.ip_address(packed)) if packed is not None and len(packed) in (4, 16) else ""


def _name(index: int) -> str:
    try:
        return socket.if_indextoname(index)
    except (OSError, OverflowError):
        return ""
