"""An encoder by CANopen (CiA 406) on your desk: python can_encoder.py CHANNEL EDS. A number and Enter sets its speed.

The number is in steps per second; `q` ends it. CHANNEL is a CAN interface, for example vcan0; other interfaces of
python-can than the kernel's: --interface. EDS is the data sheet that the mapping has too. What it shows as PDO 1 is
what the manager on the bus has laid out there.
"""

import argparse
import asyncio
import sys

import can
import canopen

POSITION, SPEED = 0x6004, 0x6030
PERIOD = 0.02
"""Seconds between two positions, and between two PDOs."""


class Encoder:
    """A node of python-canopen, with what an application has to add: boot-up after a reset, and its PDO."""

    def __init__(self, bus: can.BusABC, eds: str, node: int) -> None:
        self.network = canopen.Network(bus)
        self.network.connect()
        self.node = canopen.LocalNode(node, eds)
        self.network.add_node(self.node)
        self.network.subscribe(0, self.commanded)
        self.position = 0.0
        self.boot()

    def boot(self) -> None:
        """Leaving INITIALISING sends the boot-up message."""
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def commanded(self, _can_id: int, data: bytearray, _moment: float) -> None:
        """NMT: a reset is a boot; python-canopen does the rest."""
        if data[0] in (129, 130) and data[1] in (0, self.node.id):
            self.boot()

    async def run(self) -> None:
        """Turn, and send the PDO while in operation."""
        pdo, was_operational = self.node.tpdo[1], False
        while True:
            speed = self.node.sdo[SPEED][1].raw
            self.position += speed * PERIOD
            self.node.sdo[POSITION].raw = int(self.position) % (1 << 32)
            is_operational = self.node.nmt.state == "OPERATIONAL"
            if is_operational and not was_operational:
                self.node.tpdo.read()  # as the manager has laid them out
            was_operational = is_operational
            if is_operational and pdo.enabled:
                for each in pdo.map:
                    found = self.node.sdo[each.index]
                    each.raw = found[each.subindex].raw if each.subindex else found.raw
                pdo.transmit()
            await asyncio.sleep(PERIOD)


async def main(channel: str, eds: str, interface: str, node: int) -> None:
    encoder = Encoder(can.Bus(channel, interface=interface), eds, node)
    turning = asyncio.create_task(encoder.run())
    print(f"booted on {channel}, node-ID {node}", flush=True)
    while (word := (await asyncio.to_thread(sys.stdin.readline)).strip()) and word != "q":
        if word.removeprefix("-").isdecimal() and abs(int(word)) < 1 << 15:
            encoder.node.sdo[SPEED][1].raw = int(word)
            print(f"{encoder.node.nmt.state}, {word} steps per second", flush=True)
        else:
            print(f"{word!r} is no speed: -32767 to 32767, or q", flush=True)
    turning.cancel()
    encoder.network.disconnect()


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("channel")
arguments.add_argument("eds")
arguments.add_argument("--interface", default="socketcan")
arguments.add_argument("--node", type=int, default=5)
asyncio.run(main(**vars(arguments.parse_args())))
