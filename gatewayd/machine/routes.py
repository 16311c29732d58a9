"""Which way packages for an address take from this machine, asked over rtnetlink; reading needs no privilege."""

from __future__ import annotations

import ipaddress
import os
import socket
import struct
from dataclasses import dataclass
from pathlib import Path

from gatewayd.machine import netlink

# linux/rtnetlink.h
_ROUTE = struct.Struct("=BBBBBBBBI")
_RTM_GETROUTE = 26
_RTA_DST, _RTA_OIF, _RTA_GATEWAY, _RTA_PREFSRC = 1, 4, 5, 7
_RTN_LOCAL = 2
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
    with netlink.open_socket() as kernel:
        kernel.sendto(request(target.packed), (0, 0))
        return parse(kernel.recv(netlink.MAX_REPLY))


def request(packed: bytes) -> bytes:
    """What the kernel is asked for an address of four or sixteen bytes."""
    family = socket.AF_INET if len(packed) == 4 else socket.AF_INET6
    route = _ROUTE.pack(family, 8 * len(packed), 0, 0, 0, 0, 0, 0, 0)
    return netlink.question(_RTM_GETROUTE, route + netlink.attribute(_RTA_DST, packed), 1)


def parse(reply: bytes) -> Route:
    """The kernel's answer; OSError with its reason if it is a refusal, and for what cannot be read."""
    try:
        answer = netlink.answer(reply)
        if answer.error:
            raise OSError(answer.error, os.strerror(answer.error))
        kind_of_route = _ROUTE.unpack_from(answer.body)[7]
    except struct.error as error:
        raise OSError(None, "the kernel's answer cannot be read") from error
    found = dict(netlink.attributes(answer.body[_ROUTE.size :]))
    name = _name(netlink.word(found.get(_RTA_OIF)) or 0)
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


def _address(packed: bytes | None) -> str:
    return str(ipaddress.ip_address(packed)) if packed is not None and len(packed) in (4, 16) else ""


def _name(index: int) -> str:
    try:
        return socket.if_indextoname(index)
    except (OSError, OverflowError):
        return ""
