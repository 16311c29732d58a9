"""Which IP addresses this machine has now, asked over rtnetlink; reading needs no privilege.

Not by binding a socket to them: with `net.ipv4.ip_nonlocal_bind`, which machines with virtual addresses often have,
that succeeds for every address.
"""

from __future__ import annotations

import ipaddress
import socket
import struct

from gatewayd.machine import netlink

# linux/netlink.h, linux/rtnetlink.h, linux/if_addr.h
_MESSAGE = struct.Struct("=IHHII")
_ADDRESS = struct.Struct("=BBBBI")
_RTM_NEWADDR, _RTM_GETADDR = 20, 22
_NLM_F_DUMP = 0x300
_IFA_ADDRESS, _IFA_LOCAL, _IFA_FLAGS = 1, 2, 8
_IFA_F_TENTATIVE, _IFA_F_DADFAILED = 0x40, 0x08


def own_addresses() -> frozenset[str]:
    """All of them, as texts in their usual form. OSError if the kernel cannot be asked."""
    found: set[str] = set()
    with netlink.open_socket() as kernel:
        kernel.sendto(request(), (0, 0))
        while True:
            reply = kernel.recv(netlink.MAX_REPLY)
            addresses, ended = parse(reply)
            found |= addresses
            if ended:
                return frozenset(found)


def request() -> bytes:
    """What the kernel is asked."""
    body = _ADDRESS.pack(socket.AF_UNSPEC, 0, 0, 0, 0)
    return _MESSAGE.pack(_MESSAGE.size + len(body), _RTM_GETADDR, 1 | _NLM_F_DUMP, 1, 0) + body


def parse(reply: bytes) -> tuple[set[str], bool]:
    """The addresses in one piece of the kernel's answer, and whether it is the last.

    One that is not usable yet, or never, because another machine may have it, does not count.
    """
    found: set[str] = set()
    place = 0
    while place + _MESSAGE.size <= len(reply):
        length, kind, *_ = _MESSAGE.unpack_from(reply, place)
        if length < _MESSAGE.size or kind != _RTM_NEWADDR:
            return found, True
        body = reply[place + _MESSAGE.size : place + length]
        address = _usable(body) if len(body) >= _ADDRESS.size else ""
        if address:
            found.add(address)
        place += (length + 3) & ~3
    return found, not reply


def _usable(body: bytes) -> str:
    flags = _ADDRESS.unpack_from(body)[2]
    attributes = dict(netlink.attributes(body[_ADDRESS.size :]))
    flags |= netlink.word(attributes.get(_IFA_FLAGS)) or 0
    if flags & (_IFA_F_TENTATIVE | _IFA_F_DADFAILED):
        return ""
    packed = attributes.get(_IFA_LOCAL) or attributes.get(_IFA_ADDRESS) or b""
    return str(ipaddress.ip_address(packed)) if len(packed) in (4, 16) else ""
