"""Faults of PLCs, and of strangers at the Modbus port."""

from __future__ import annotations

import socket
import struct
import time
from contextlib import ExitStack, suppress
from random import Random

from tests.e2e.plc import STRANGER
from tests.e2e.processes import HOST, wait_for
from tests.soak.cell import FIELDS_OF, FIRST, SECOND
from tests.soak.faults.common import kill_writer, suspend
from tests.soak.rig import PATIENCE, Rig
from tests.soak.truth import Period

_READ = bytes.fromhex("000100000006 01 03 EA60 007D")
"""FC3 of 125 registers of the status block."""


def kill_plc(rig: Rig, chance: Random) -> None:
    kill_writer(rig, chance.choice((FIRST, SECOND)))


def half_open_plc(rig: Rig, chance: Random) -> None:
    """It hangs; its connection stands. Its locks are free before it comes back."""
    name = chance.choice((FIRST, SECOND))
    begin = time.monotonic()
    suspend(
        rig.clients[name], lambda: wait_for(lambda: not rig.look.locks_of(name), f"{name}'s locks", PATIENCE)
    )
    rig.record.pauses.append(Period(begin, time.monotonic(), FIELDS_OF[name]))


def garbage(rig: Rig, chance: Random) -> None:
    for _ in range(chance.randint(1, 20)):
        with suppress(OSError), _connected(rig) as peer:
            for _ in range(chance.randint(1, 5)):
                data = chance.randbytes(chance.randint(1, 400))
                if chance.random() < 0.5:
                    data = struct.pack(">HHHB", chance.randrange(65536), 0, len(data) + 1, 1) + data
                peer.sendall(data)


def never_reads(rig: Rig, chance: Random) -> None:
    """Asks until nothing more fits into the connection, and keeps it."""
    with _connected(rig) as peer:
        peer.setblocking(False)
        with suppress(OSError):
            for _ in range(2000):
                peer.send(_READ * 1000)
        time.sleep(chance.uniform(0.5, 2))


def half_request(rig: Rig, chance: Random) -> None:
    with _connected(rig) as peer:
        peer.sendall(_READ[: chance.randint(1, len(_READ) - 1)])
        time.sleep(chance.uniform(0.1, 1))


def burst(rig: Rig, chance: Random) -> None:
    """More connections than are allowed, all at once, then gone."""
    with ExitStack() as all_of_them:
        for _ in range(chance.randint(40, 200)):
            with suppress(OSError):
                all_of_them.enter_context(_connected(rig))


def _connected(rig: Rig) -> socket.socket:
    return socket.create_connection((HOST, rig.modbus), 5, (STRANGER, 0))
