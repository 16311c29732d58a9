"""A gripper by Modbus RTU on your desk, with the registers of Robotiq's 2F and Hand-E grippers: python gripper.py PATH.

PATH becomes the serial port that leads to it: a pseudo terminal, so the baud rate is whatever you like. Its fingers
move when they are asked to, and stop at a part that they hold. Ctrl-C ends it.
"""

import argparse
import asyncio
import contextlib
import os
import pty
import tty
from pathlib import Path

from pymodbus.server import ModbusSerialServer
from pymodbus.simulator import DataType, SimData, SimDevice

UNIT, ASKED, REPORTED = 9, 1000, 2000
"""Unit id, the first register that is written, and the first that is read."""
READ, WRITE = 4, 16
"""Function codes."""
PART, STEP, PERIOD = 200, 5, 0.02
"""Where the fingers meet a part (0 open, 255 closed), and how far they move in how many seconds."""


async def main(path: Path) -> None:
    blocks = [SimData(first, values=[0] * 3, datatype=DataType.REGISTERS) for first in (ASKED, REPORTED)]
    server = ModbusSerialServer(SimDevice(UNIT, blocks), port=line(path), baudrate=115200)
    await server.serve_forever(background=True)
    print(f"listening on {path}, unit {UNIT}", flush=True)
    position, before = 0, None
    while True:
        action, wanted, _ = await server.async_getValues(UNIT, READ, ASKED, 3)
        is_active, goes, wanted = action >> 8 & 1, action >> 11 & 1, wanted & 0xFF
        reachable = min(wanted, PART)
        if is_active and goes:
            position += max(-STEP, min(STEP, reachable - position))
        found = (3 if wanted == reachable else 2) if position == reachable else 0
        status = is_active * 0x31 | goes << 3 | found << 6
        await server.async_setValues(UNIT, WRITE, REPORTED, [status << 8, wanted, position << 8])
        if (state := (is_active, found, position if found else None)) != before:
            words = {0: "moves", 2: f"holds a part at {position}", 3: f"is at {position}"}[found]
            print(words if is_active else "is not activated", flush=True)
            before = state
        await asyncio.sleep(PERIOD)


def line(path: Path) -> str:
    """Make PATH one end of a serial line; the other end's name."""
    loop = asyncio.get_running_loop()
    (here, there), (far, near) = pty.openpty(), pty.openpty()
    for file in (there, near):
        tty.setraw(file)
    loop.add_reader(here, lambda: os.write(far, os.read(here, 256)))
    loop.add_reader(far, lambda: os.write(here, os.read(far, 256)))
    path.unlink(missing_ok=True)
    path.symlink_to(os.ttyname(there))
    return os.ttyname(near)


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("path", type=Path, help="for example /tmp/gripper")
with contextlib.suppress(KeyboardInterrupt):
    asyncio.run(main(**vars(arguments.parse_args())))
