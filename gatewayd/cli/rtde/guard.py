"""What keeps a command from writing to a robot: a gateway that serves it, a program that runs."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gatewayd.loop.resolve import hosts, look_up
from gatewayd.report.format import parse_address
from gatewayd.rtde.enums import MEANINGS, PROGRAM_IDLE

if TYPE_CHECKING:
    from gatewayd.cli.rtde.gateway_processes import GatewayProcess

_PATIENCE = 1.0


def gateway_in_the_way(
    host: str, port: int, named: Path | None = None, *, beside_unknown: bool = False
) -> str:
    """Why a gateway on this machine forbids to write to the robot, in words; empty if none does.

    Asked are those at the usual places, the one at the socket `named`, and all whose sockets /proc shows. One that has
    a connection to the robot forbids it, and so does one that gives no answer where it is to serve the robot by its
    mapping files, or, unless `beside_unknown`, where that cannot be found out. A gateway on another machine is not
    seen: what it has claimed is IN_USE.
    """
    from gatewayd.cli.rtde.gateway_processes import gateway_processes, is_gateway, listener
    from gatewayd.control.running import ask, sockets
    from gatewayd.machine.connections import connected_processes

    processes = tuple(gateway_processes())
    usual = [*sockets(None, os.environ), *(() if named is None else (named,))]
    found = ask(tuple(dict.fromkeys((*usual, *(place for each in processes for place in each.sockets)))))
    wanted = _addresses(host, port)
    for cell in found.cells:
        if _addresses(*parse_address(cell.status["robot"]["address"])) & wanted:
            return (
                f"the gateway at {cell.socket} serves this robot as cell {cell.status['name']}: "
                "write by it, with gatewayd force"
            )
    for place, reason in found.silent:
        if Path(place) in usual and not beside_unknown and not _is_dead(place):
            return f"a gateway may serve this robot, and does not say so: {reason}; {_REMEDY}"
    for connected in connected_processes(wanted):
        if is_gateway(connected.command):
            return (
                f"a gateway (process {connected.pid}) is connected to this robot, and its control socket was not "
                "found: write by it, with gatewayd force --socket PATH"
            )
    answered = {listener(Path(place)) for place in found.sockets}
    silent = [process for process in processes if process.pid not in answered]
    return next(filter(None, (_suspicion(each, wanted, unknown=not beside_unknown) for each in silent)), "")


_REMEDY = "--beside-unknown-gateway writes all the same"


def _suspicion(process: GatewayProcess, wanted: set[tuple[str, int]], *, unknown: bool) -> str:
    """What speaks against writing beside a gateway that says nothing itself."""
    served = {file: _robots(file) for file in process.files or ()}
    for file, robots in served.items():
        if robots & wanted:
            return (
                f"a gateway (process {process.pid}) is to serve this robot by {file}, and its control socket was not "
                "found or gives no answer: stop it, or write by it, with gatewayd force --socket PATH"
            )
    if not unknown or (served and all(served.values())):
        return ""
    return (
        f"a gateway (process {process.pid}) runs on this machine, and which robot it serves is not known: neither its "
        f"control socket nor its mapping files can be read; run this command as its user, or {_REMEDY}"
    )


def _robots(path: Path) -> set[tuple[str, int]]:
    """The robots of a mapping file, or of a directory of them; none where one of them cannot be read."""
    from gatewayd.links.registry import definer, kind_of
    from gatewayd.mapping.files import files_of
    from gatewayd.mapping.loader import load, read_bytes

    try:
        plans = [load(read_bytes(file), str(file)).plan for file in files_of(path)]
    except OSError:
        return set()
    found: set[tuple[str, int]] = set()
    for plan in plans:
        if plan is None:
            return set()
        robots = (link for link in plan.links.values() if link.kind == definer().key)
        for robot in robots:
            found |= _addresses(*parse_address(kind_of(robot.kind).describe(robot, plan.cell).address))
    return found


def program_in_the_way(state: int | None) -> str:
    """Why the program's state (`runtime_state`; None: not known) forbids to write, in words; empty if it does not."""
    if state in PROGRAM_IDLE:
        return ""
    if state is None:
        return "the controller does not say whether a program runs"
    words: Mapping[int, str] = MEANINGS["runtime_state"]
    return f"the program is {words.get(state, f'in state {state}')}"


def _addresses(host: str, port: int) -> set[tuple[str, int]]:
    """Where a name leads to; the name itself where it leads nowhere."""
    try:
        return {(address, port) for address in hosts(look_up(host, port))}
    except OSError:
        return {(host, port)}


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
