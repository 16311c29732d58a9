"""TCP ports: whether this machine can have one, who has it, and whether one elsewhere can be reached."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from gatewayd.loop.resolve import look_up

_PROC = Path("/proc")
_LISTENING = "0A"
"""State of a socket in /proc/net/tcp that accepts connections."""
_INODE = re.compile(r"socket:\[([0-9]+)\]")


def bind_failure(host: str, port: int) -> OSError | None:
    """Why a listener cannot have host and port, as asyncio would take them; None: it can. A name may take time.

    They are bound for an instant, and not listened on: nobody can connect meanwhile.
    """
    try:
        addresses = look_up(host or None, port, socket.AI_PASSIVE)
    except OSError as error:
        return error
    for family, kind, protocol, address in addresses:
        with socket.socket(family, kind, protocol) as attempt:
            attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                attempt.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            try:
                attempt.bind(address)
            except OSError as error:
                return error
    return None


async def connect_error(addresses: list[str], port: int, patience: float) -> OSError | None:
    """Why none of the addresses accepts a connection at the port; None: one does. It is closed at once."""
    failure: OSError = OSError(errno.EADDRNOTAVAIL, "no address")
    for address in addresses:
        try:
            async with asyncio.timeout(patience):
                _, writer = await asyncio.open_connection(address, port)
        except TimeoutError:
            failure = OSError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT))
        except OSError as error:
            failure = error
        else:
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()
            return None
    return failure


def holder(port: int, proc: Path = _PROC) -> str:
    """The process that listens on the port: `python3 (pid 1234)`; empty if that cannot be seen, or nobody does."""
    inodes = set(listening_inodes(port, proc))
    for directory in proc.glob("[0-9]*"):
        with suppress(OSError):  # ended meanwhile, or of another user
            if inodes.isdisjoint(socket_inodes(directory)):
                continue
            name = (directory / "comm").read_text("utf-8", "replace").strip()
            return f"{name} (pid {directory.name})"
    return ""


def socket_inodes(process: Path) -> Iterator[str]:
    """The inodes of the sockets of a process, named by its directory in /proc; PermissionError: another user's."""
    for descriptor in list((process / "fd").iterdir()):
        with suppress(OSError):  # closed meanwhile
            found = _INODE.fullmatch(str(descriptor.readlink()))
            if found is not None:
                yield found[1]


def listening_inodes(port: int, proc: Path = _PROC) -> Iterator[str]:
    """The inodes of sockets that listen on the port, at whatever address."""
    for table in ("tcp", "tcp6"):
        try:
            lines = (proc / "net" / table).read_text("ascii", "replace").splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            words = line.split()
            if len(words) > 9 and words[3] == _LISTENING and words[1].endswith(f":{port:04X}"):
                yield words[9]
