"""Which processes of this machine have a TCP connection to an address, by what the kernel shows in /proc."""

from __future__ import annotations

import socket
import struct
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from gatewayd.machine.ports import socket_inodes

_PROC = Path("/proc")
_ESTABLISHED = "01"
_FAMILIES = {"tcp": socket.AF_INET, "tcp6": socket.AF_INET6}


@dataclass(frozen=True, slots=True)
class ConnectedProcess:
    """A process that has, or may have, such a connection."""

    pid: int
    command: tuple[str, ...]
    """Its command line."""


def connected_processes(
    addresses: Collection[tuple[str, int]], proc: Path = _PROC
) -> Iterator[ConnectedProcess]:
    """Processes with an established connection to one of the addresses, each with its port.

    Of another user's process its connections cannot be seen: it is taken for one that has it, if nobody else has.
    """
    inodes = set(_established(addresses, proc))
    hidden: list[ConnectedProcess] = []
    for directory in proc.glob("[0-9]*") if inodes else ():
        with suppress(OSError):  # it has ended meanwhile
            command = (directory / "cmdline").read_bytes().decode(errors="replace").split("\0")
            process = ConnectedProcess(int(directory.name), tuple(command))
            try:
                found = inodes.intersection(socket_inodes(directory))
            except PermissionError:
                hidden.append(process)
                continue
            if found:
                inodes -= found
                yield process
    if inodes:
        yield from hidden


def _established(addresses: Collection[tuple[str, int]], proc: Path) -> Iterator[str]:
    """The inodes of the connections."""
    for table, family in _FAMILIES.items():
        try:
            lines = (proc / "net" / table).read_text("ascii", "replace").splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            words = line.split()
            if len(words) > 9 and words[3] == _ESTABLISHED and _address(words[2], family) in addresses:
                yield words[9]


def _address(text: str, family: socket.AddressFamily) -> tuple[str, int]:
    """`0100007F:7534`: words of 32 bits as this machine has them in memory, and the port."""
    host, _, port = text.partition(":")
    packed = b"".join(struct.pack("=I", int(host[place : place + 8], 16)) for place in range(0, len(host), 8))
    return socket.inet_ntop(family, packed), int(port, 16)
