"""Faults on the CAN bus. A frame has no sender: what a fault puts there is as good as the master's."""

from __future__ import annotations

import socket
import time
from contextlib import closing
from random import Random

from tests.e2e.processes import HOST, wait_for
from tests.soak.cell import MASTER, MASTER_FIELDS, NODE
from tests.soak.faults.common import kill_writer, unjudged
from tests.soak.master import HEARTBEAT, NMT, OPERATIONAL
from tests.soak.rig import PATIENCE, Rig

_STOP, _PRE_OPERATIONAL, _RESET_NODE, _RESET_COMMUNICATION = 2, 128, 129, 130
"""NMT commands (CiA 301, 7.2.8.3.1)."""
_SDO_REQUEST = 0x600
_HEARTBEAT_OF_THE_NODE = 0x700 + NODE
_OBJECTS = ((0x1000, 0x1FFF), (0x2000, 0x24FF), (0x5F00, 0x5F50))
"""Where the node has some."""
_MALFORMED = (
    b"t\r",
    b"t9\r",
    b"t2109\r",
    b"tXYZ8\r",
    b"t2108zz\r",
    b"T0000\r",
    b"t70115\xff\r",
    b"t" + b"0" * 500 + b"\r",
)
"""What a broken adapter says."""


class _Tap:
    """A connection to the bus."""

    def __init__(self, rig: Rig) -> None:
        self._socket = socket.create_connection((HOST, rig.can), 5)
        self._socket.setblocking(False)
        self._heard = b""

    def close(self) -> None:
        self._socket.close()

    def say(self, data: bytes) -> None:
        self._socket.setblocking(True)
        self._socket.sendall(data)
        self._socket.setblocking(False)

    def hears(self, start: bytes, *excepted: bytes) -> bool:
        """Whether a line with this start came since the last call, other than those `excepted`."""
        try:
            self._heard += self._socket.recv(1 << 20)
        except BlockingIOError:
            return False
        *lines, self._heard = self._heard.split(b"\r")
        return any(line.startswith(start) and line not in excepted for line in lines)


def _line(identifier: int, data: bytes) -> bytes:
    return f"t{identifier:03X}{len(data)}{data.hex()}\r".encode()


def kill_master(rig: Rig, _chance: Random) -> None:
    kill_writer(rig, MASTER)


def cut_bus(rig: Rig, chance: Random) -> None:
    rig.end_bus()
    wait_for(lambda: any("CAN" in ill for ill in rig.look.ills()), "the bus to be missed", PATIENCE)
    time.sleep(chance.uniform(0, 1))
    rig.start_bus()


def command_node(rig: Rig, chance: Random) -> None:
    _command(rig, chance.choice((_STOP, _PRE_OPERATIONAL, _RESET_NODE, _RESET_COMMUNICATION)))


def _command(rig: Rig, command: int, before: bytes = b"") -> None:
    """Over when the node has said that it is no longer OPERATIONAL."""
    with closing(_Tap(rig)) as tap:
        tap.say(before + _line(NMT, bytes([command, NODE])))
        start = f"t{HEARTBEAT + NODE:03X}1".encode()
        operational = start + f"{OPERATIONAL:02X}".encode()
        wait_for(lambda: tap.hears(start, operational), "the node to obey", PATIENCE)


def flood(rig: Rig, chance: Random) -> None:
    """Any frame, SDO requests of all sorts, and lines that are no frames.

    The flood ends as a technician would end it, with "reset node": SDOs may have changed any parameter.
    """
    count = chance.randint(200, 2000)
    hostile = b"".join(chance.choice((_any_frame, _sdo_request))(chance) for _ in range(count))
    malformed = b"".join(chance.choices(_MALFORMED, k=chance.randint(0, 3)))
    with unjudged(rig, MASTER_FIELDS):
        _command(rig, _RESET_NODE, hostile + malformed)


def _any_frame(chance: Random) -> bytes:
    # Not NMT: the others on the bus have a claim to their node as well. Nor the node's own heartbeat: that there is
    # another node of its number is rightly reported for a minute, which would hide what the next faults do.
    identifier = chance.choice([number for number in range(1, 0x800) if number != _HEARTBEAT_OF_THE_NODE])
    return _line(identifier, chance.randbytes(chance.randint(0, 8)))


def _sdo_request(chance: Random) -> bytes:
    index = chance.randint(*chance.choice(_OBJECTS))
    data = bytes([chance.randrange(256)]) + index.to_bytes(2, "little") + bytes([chance.randrange(8)])
    return _line(_SDO_REQUEST + NODE, data + chance.randbytes(4))
