"""What keeps a command from writing to a robot: a gateway that serves it, a program that runs."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from gatewayd.report.format import parse_address
from gatewayd.rtde.enums import MEANINGS, PROGRAM_IDLE

_PATIENCE = 1.0
_GATEWAY_COMMANDS = ("run", "demo")


def gateway_in_the_way(host: str, port: int, named: Path | None = None) -> str:
    """Why a gateway on this machine forbids to write to the robot, in words; empty if none does.

    All are asked that are found, and the one at the socket `named`.
    One that is there and gives no answer forbids it too: what it serves is not known. So does one that has a
    connection to the robot, and no socket that was found.
    """
    from gatewayd.control.running import ask, sockets
    from gatewayd.machine.connections import connected_processes

    places = [*sockets(None, os.environ), *(() if named is None else (named,))]
    found = ask(tuple(dict.fromkeys(places)))
    wanted = _addresses(host, port)
    for cell in found.cells:
        if _addresses(*parse_address(cell.status["robot"]["address"])) & wanted:
            return (
                f"the gateway at {cell.socket} serves this robot as cell {cell.status['name']}: "
                "write by it, with gatewayd force"
            )
    for place, reason in found.silent:
        if not _is_dead(place):
            return f"a gateway may serve this robot, and does not say so: {reason}"
    for process in connected_processes(wanted):
        if _is_gateway(process.command):
            return (
                f"a gateway (process {process.pid}) is connected to this robot, and its control socket was not found: "
                "write by it, with gatewayd force --socket PATH"
            )
    return ""


def program_in_the_way(state: int | None) -> str:
    """Why the program's state (`runtime_state`; None: not known) forbids to write, in words; empty if it does not."""
    if state in PROGRAM_IDLE:
        return ""
    if state is None:
        return "the controller does not say whether a program runs"
    words: Mapping[int, str] = MEANINGS["runtime_state"]
    return f"the program is {words.get(state, f'in state {state}')}"


def _is_gateway(command: Sequence[str]) -> bool:
    """Whether a command line is `gatewayd run`, by whatever interpreter."""
    return any(
        Path(program).name == "gatewayd" and argument in _GATEWAY_COMMANDS
        for program, argument in pairwise(command)
    )


def _addresses(host: str, port: int) -> set[tuple[str, int]]:
    """Where a name leads to; the name itself where it leads nowhere."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return {(host, port)}
    return {(str(address[0]), port) for *_, address in found}


def _is_dead(place: str) -> bool:
    """Whether nobody listens at a socket any more."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(_PATIENCE)
        try:
            probe.connect(place)
        except (ConnectionRefusedError, FileNotFoundError):
            return True
        except OSError:
            return False
    return False
