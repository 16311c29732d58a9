"""Files of traffic for other tools: pcapng for Wireshark, the log of candump for can-utils. Pure.

TCP connections are made up around what was said on them (the gateway knows no packets): Ethernet, IP and TCP headers
with the true addresses, sequence numbers that fit, and the server's port as other tools know the protocol.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from ipaddress import ip_address

from gatewayd.links.contract import Medium
from gatewayd.report.format import parse_address

_ETHERNET, _CAN = 1, 227
"""LINKTYPE_ETHERNET, LINKTYPE_CAN_SOCKETCAN."""
_SECTION = struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28)
_LONGEST = 1400
"""Bytes of one made-up segment."""
_MICROSECONDS = 1_000_000


@dataclass(frozen=True, slots=True)
class Captured:
    """One passage, as a file needs it."""

    time: float
    """Seconds since 1970."""
    medium: Medium
    port: int
    """Of the server, as other tools know the protocol."""
    peer: str
    own: str
    outgoing: bool
    data: bytes


def candump_line(captured: Captured) -> str:
    """`(1700000000.123456) can0 185#0102`; empty for what is no CAN frame."""
    if captured.medium is not Medium.CAN or len(captured.data) != 16:
        return ""
    can_id, length = struct.unpack_from(">IB", captured.data)
    data = captured.data[8 : 8 + length].hex().upper()
    content = f"R{length or ''}" if can_id & 0x4000_0000 else data
    interface = "".join(sign if sign.isalnum() or sign in "._-" else "_" for sign in captured.own) or "can"
    return f"({captured.time:.6f}) {interface} {can_id & 0x7FF:03X}#{content}"


class PcapWriter:
    """Makes the blocks of one pcapng file, in which Modbus, RTDE and CAN lie side by side."""

    def __init__(self) -> None:
        self._interfaces: dict[tuple[int, str], int] = {}
        self._sent: dict[tuple[str, str, int, bool], int] = {}
        self._begun = False

    def blocks(self, captured: Captured) -> bytes:
        """What the file has of the passage, with its own head before the first one."""
        head = b"" if self._begun else _SECTION
        self._begun = True
        if captured.medium is Medium.CAN:
            return head + self._packet(_CAN, captured.own, captured.time, captured.data)
        if captured.medium is Medium.OTHER:
            return head
        parts = range(0, len(captured.data), _LONGEST)
        return head + b"".join(
            self._packet(
                _ETHERNET,
                "gatewayd",
                captured.time,
                self._segment(captured, captured.data[at : at + _LONGEST]),
            )
            for at in parts
        )

    def _packet(self, kind: int, name: str, time: float, packet: bytes) -> bytes:
        key = kind, name
        described = b""
        if key not in self._interfaces:
            self._interfaces[key] = len(self._interfaces)
            option = name.encode()[:255]
            body = struct.pack("<HHI", kind, 0, 0) + _option(2, option) + struct.pack("<HH", 0, 0)
            described = _block(1, body)
        moment = round(time * _MICROSECONDS)
        head = struct.pack(
            "<IIIII",
            self._interfaces[key],
            moment >> 32,
            moment & 0xFFFF_FFFF,
            len(packet),
            len(packet),
        )
        return described + _block(6, head + _padded(packet))

    def _segment(self, captured: Captured, data: bytes) -> bytes:
        """Ethernet, IP and TCP around data of one connection."""
        own, own_port = _split(captured.own)
        peer, peer_port = _split(captured.peer)
        if captured.medium is Medium.TCP_SERVER:
            own_port = captured.port
        else:
            peer_port = captured.port
        flow = captured.own, captured.peer, captured.port
        sent = self._sent.get((*flow, captured.outgoing), 1)
        heard = self._sent.get((*flow, not captured.outgoing), 1)
        self._sent[(*flow, captured.outgoing)] = sent + len(data) & 0xFFFF_FFFF
        ends = (own, own_port, peer, peer_port) if captured.outgoing else (peer, peer_port, own, own_port)
        return _ethernet(*ends, tcp=(sent, heard), data=data)


def _ethernet(
    source: bytes, source_port: int, target: bytes, target_port: int, *, tcp: tuple[int, int], data: bytes
) -> bytes:
    if len(source) != len(target):
        source, target = (
            b"\0" * 10 + b"\xff\xff" + end if len(end) == 4 else end for end in (source, target)
        )
    length = 20 + len(data)
    pseudo = source + target + struct.pack(">BBH", 0, 6, length)
    segment = struct.pack(">HHIIBBHHH", source_port, target_port, *tcp, 5 << 4, 0x18, 0xFFFF, 0, 0) + data
    checksum = _checksum(pseudo + segment)
    segment = segment[:16] + struct.pack(">H", checksum) + segment[18:]
    if len(source) == 16:
        kind, head = 0x86DD, struct.pack(">IHBB", 6 << 28, length, 6, 64) + source + target
    else:
        head = struct.pack(">BBHHHBBH", 0x45, 0, 20 + length, 0, 0x4000, 64, 6, 0) + source + target
        kind, head = 0x0800, head[:10] + struct.pack(">H", _checksum(head)) + head[12:]
    return b"\x02\0\0\0\0\2" + b"\x02\0\0\0\0\1" + struct.pack(">H", kind) + head + segment


def _checksum(data: bytes) -> int:
    """The Internet checksum (RFC 1071)."""
    words: tuple[int, ...] = struct.unpack(f">{(len(data) + 1) // 2}H", data + bytes(len(data) % 2))
    total = sum(words)
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def _split(end: str) -> tuple[bytes, int]:
    """Address and port of `192.0.2.1:502`; an end that is none is 0.0.0.0, port 0."""
    try:
        host, port = parse_address(end)
        return ip_address(host.partition("%")[0]).packed, port
    except ValueError:
        return bytes(4), 0


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _block(kind: int, body: bytes) -> bytes:
    length = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + length + body + length
