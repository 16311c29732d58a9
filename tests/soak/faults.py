"""The faults of a soak run: each brings one kind of trouble and takes it away. What comes then is up to the daemon.

Whatever a fault chooses comes from the `Random` it is given, so that a seed makes the same faults again.
"""

from __future__ import annotations

import os
import signal
import socket
import struct
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from random import Random

from tests.e2e.plc import STRANGER
from tests.e2e.processes import HOST, Process, wait_for
from tests.soak.rig import FIRST, HELD, PATIENCE, SECOND, VARIANTS, Rig

__all__ = ["BOUND", "FAULTS", "Fault", "bound"]

Fault = Callable[[Rig, Random], None]
BOUND = 5.0
"""Seconds after a fault in which all must be well."""
_BOUNDS = {"simulator killed": 10.0, "register held": 10.0}
"""Those that need longer: a robot that was away is tried again at growing intervals."""
_READ = bytes.fromhex("000100000006 01 03 EA60 007D")
"""FC3 of 125 registers of the status block."""


def bound(kind: str) -> float:
    """Seconds in which this kind must be over; GATEWAYD_SOAK_PATIENCE multiplies them, for machines that are shared."""
    return _BOUNDS.get(kind, BOUND) * float(os.environ.get("GATEWAYD_SOAK_PATIENCE", "1"))


def _drop_clients(rig: Rig, _chance: Random) -> None:
    rig.simulator.do("drop-clients")


def _silence(rig: Rig, chance: Random) -> None:
    _switched(rig, "silence", chance)


def _freeze(rig: Rig, chance: Random) -> None:
    _switched(rig, "freeze", chance)


def _switched(rig: Rig, switch: str, chance: Random) -> None:
    rig.simulator.do(f"{switch} on")
    wait_for(lambda: bool(rig.ills()), f"{switch} to be noticed", PATIENCE)
    time.sleep(chance.uniform(0, 1))
    rig.simulator.do(f"{switch} off")


def _kill_simulator(rig: Rig, chance: Random) -> None:
    rig.end_simulator()
    wait_for(lambda: bool(rig.ills()), "the robot to be missed", PATIENCE)
    time.sleep(chance.uniform(0, 2))
    rig.start_simulator()


def _hold_register(rig: Rig, chance: Random) -> None:
    """A robot program that has the register for itself when the gateway connects, and gives it up later."""
    rig.end_simulator()
    rig.start_simulator("--hold", HELD)
    wait_for(lambda: any("unavailable" in ill for ill in rig.ills()), "the held register", PATIENCE)
    time.sleep(chance.uniform(0, 1))
    rig.simulator.do(f"free {HELD}")


def _kill_plc(rig: Rig, chance: Random) -> None:
    name = chance.choice((FIRST, SECOND))
    rig.end_client(name)
    wait_for(lambda: not rig.locks_of(name), f"the locks of {name} to be free", PATIENCE)
    rig.start_client(name)


def _half_open_plc(rig: Rig, chance: Random) -> None:
    """It hangs; its connection stands. Its locks are free before it comes back."""
    name = chance.choice((FIRST, SECOND))
    _suspend(rig.clients[name], lambda: wait_for(lambda: not rig.locks_of(name), f"{name}'s locks", PATIENCE))


def _suspend_daemon(rig: Rig, _chance: Random) -> None:
    _suspend(rig.daemon, lambda: time.sleep(1))


def _suspend(process: Process, meanwhile: Callable[[], object]) -> None:
    process.signal(signal.SIGSTOP)
    try:
        meanwhile()
    finally:
        process.signal(signal.SIGCONT)


def _reload(rig: Rig, chance: Random) -> None:
    """Until the other mapping is there; a recipe that changed makes the robot start anew."""
    present = rig.values()
    now = "another place" if "extra" in present else "another field" if "fresh" in present else "plain"
    wanted = chance.choice([name for name in VARIANTS if name != now])
    rig.write_mapping(wanted)
    rig.daemon.signal(signal.SIGHUP)

    def changed() -> bool:
        names = rig.values()
        return bool(names) and (("extra" in names), ("fresh" in names)) == (
            wanted == "another place",
            wanted == "another field",
        )

    wait_for(changed, f"the mapping with {wanted}", PATIENCE)


def _broken_reload(rig: Rig, _chance: Random) -> None:
    good = rig.mapping.read_text("utf-8")
    rig.mapping.write_text(good + "variables: again\n", "utf-8")
    rig.daemon.signal(signal.SIGHUP)
    wait_for(lambda: any("reload" in ill for ill in rig.ills()), "the reload to be refused", PATIENCE)
    rig.mapping.write_text(good, "utf-8")
    rig.daemon.signal(signal.SIGHUP)


def _garbage(rig: Rig, chance: Random) -> None:
    for _ in range(chance.randint(1, 20)):
        with suppress(OSError), _connected(rig) as peer:
            for _ in range(chance.randint(1, 5)):
                data = chance.randbytes(chance.randint(1, 400))
                if chance.random() < 0.5:
                    data = struct.pack(">HHHB", chance.randrange(65536), 0, len(data) + 1, 1) + data
                peer.sendall(data)


def _never_reads(rig: Rig, chance: Random) -> None:
    """Asks until nothing more fits into the connection, and keeps it."""
    with _connected(rig) as peer:
        peer.setblocking(False)
        with suppress(OSError):
            for _ in range(2000):
                peer.send(_READ * 1000)
        time.sleep(chance.uniform(0.5, 2))


def _half_request(rig: Rig, chance: Random) -> None:
    with _connected(rig) as peer:
        peer.sendall(_READ[: chance.randint(1, len(_READ) - 1)])
        time.sleep(chance.uniform(0.1, 1))


def _burst(rig: Rig, chance: Random) -> None:
    """More connections than are allowed, all at once, then gone."""
    with ExitStack() as all_of_them:
        for _ in range(chance.randint(40, 200)):
            with suppress(OSError):
                all_of_them.enter_context(_connected(rig))


def _connected(rig: Rig) -> socket.socket:
    return socket.create_connection((HOST, rig.modbus), 5, (STRANGER, 0))


FAULTS: dict[str, Fault] = {
    "clients dropped": _drop_clients,
    "robot silent": _silence,
    "robot frozen": _freeze,
    "simulator killed": _kill_simulator,
    "register held": _hold_register,
    "PLC killed": _kill_plc,
    "PLC half-open": _half_open_plc,
    "daemon suspended": _suspend_daemon,
    "reload": _reload,
    "broken reload": _broken_reload,
    "garbage": _garbage,
    "peer never reads": _never_reads,
    "half a request": _half_request,
    "connection burst": _burst,
}
"""Kind -> what does it."""
