"""Gateways that run on this machine, by what the kernel shows of processes: their sockets and their mapping files.

Of another user's process its command line can be seen, and neither its sockets nor, where they are relative, its files.
"""

from __future__ import annotations

import os
import socket
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

_PROC = Path("/proc")
_ACCEPTS = 0x10000
"""Flag of a socket in /proc/net/unix that listens (__SO_ACCEPTCON)."""
_COMMANDS = ("run", "demo")
_CREDENTIALS = struct.Struct("3i")


@dataclass(frozen=True, slots=True)
class GatewayProcess:
    """A process that is `gatewayd run`."""

    pid: int
    sockets: tuple[Path, ...]
    """Where it listens for commands, as far as that can be seen."""
    files: tuple[Path, ...] | None
    """The mapping files and directories that it was started with; None: where they lie cannot be seen."""


def is_gateway(command: Sequence[str]) -> bool:
    """Whether a command line is `gatewayd run`, or the demonstration, by whatever interpreter."""
    return any(
        Path(program).name == "gatewayd" and argument in _COMMANDS for program, argument in pairwise(command)
    )


def gateway_processes(proc: Path = _PROC) -> Iterator[GatewayProcess]:
    """Every other process that is `gatewayd run`. The demonstration serves a robot of its own."""
    for directory in proc.glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            command = (directory / "cmdline").read_bytes().decode(errors="replace").split("\0")
            if is_gateway(command) and "run" in command and int(directory.name) != os.getpid():
                yield _read(directory, command)


def listener(path: Path) -> int:
    """The process that listens at a socket (SO_PEERCRED, unix(7)); 0 if that cannot be found out."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
            found = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        except OSError:
            return 0
        return int(_CREDENTIALS.unpack(found)[0])


def _read(directory: Path, command: Sequence[str]) -> GatewayProcess:
    from gatewayd.cli.run import command as run

    arguments = [word for word in command[command.index("run") + 1 :] if word]
    options = run.make_context("run", arguments, resilient_parsing=True).params
    named = options.get("control")
    sockets = set(_bound(directory))
    if named is not None and str(named) != "none":
        sockets |= {found for found in (_inside(directory, Path(named)),) if found is not None}
    files = [_inside(directory, Path(file)) for file in options.get("files") or ()]
    known = tuple(file for file in files if file is not None)
    return GatewayProcess(
        int(directory.name), tuple(sorted(sockets)), known if known and len(known) == len(files) else None
    )


def _bound(directory: Path) -> Iterator[Path]:
    """The paths at which the process listens."""
    from gatewayd.machine.ports import socket_inodes

    with suppress(OSError):
        listening = _listening(directory)
        for inode in socket_inodes(directory):
            found = _inside(directory, listening[inode]) if inode in listening else None
            if found is not None:
                yield found


def _listening(directory: Path) -> Mapping[str, Path]:
    """Inode -> path of the sockets that listen in the network namespace of the process (proc(5), /proc/net/unix)."""
    lines = (directory / "net" / "unix").read_text("utf-8", "replace").splitlines()[1:]
    rows = (line.split(maxsplit=7) for line in lines)
    return {
        row[6]: Path(row[7])
        for row in rows
        if len(row) > 7 and int(row[3], 16) & _ACCEPTS and not row[7].startswith("@")
    }


def _inside(directory: Path, path: Path) -> Path | None:
    """A path of a process as this one sees it: relative to where that works, below its root in a container.

    None: where that is cannot be seen.
    """
    try:
        root, place = (directory / "root").readlink(), (directory / "cwd").readlink()
    except OSError:
        return path if path.is_absolute() else None
    absolute = place / path
    return absolute if root == Path("/") else directory / "root" / absolute.relative_to("/")
