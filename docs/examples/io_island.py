"""An I/O island by Modbus TCP on your desk; a number and Enter toggles a discrete input: python io_island.py HOST PORT.

Other inputs: `air 6.1` sets the analogue input (input register 0, 32767 for 10 bar); `q` ends it. Coils are printed
when they are written.
"""

import argparse
import asyncio
import sys

from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

UNIT, POINTS, FULL_SCALE = 1, 8, 32767 / 10
DISCRETE, ANALOGUE, WRITES = 2, 4, (5, 15)
"""Function codes: read discrete inputs, read input registers, write one coil, write coils."""


async def main(host: str, port: int) -> None:
    bits = SimData(0, values=[False] * 16, datatype=DataType.BITS)
    registers = SimData(0, values=[0] * POINTS, datatype=DataType.REGISTERS)
    device = SimDevice(UNIT, ([bits], [bits], [registers], [registers]), action=written)
    server = ModbusTcpServer(device, address=(host, port))
    await server.serve_forever(background=True)
    print(f"listening on {host}:{port}, unit {UNIT}", flush=True)
    while (word := (await asyncio.to_thread(sys.stdin.readline)).strip()) and word != "q":
        name, _, number = word.partition(" ")
        if name == "air" and number.replace(".", "", 1).isdecimal():
            await server.async_setValues(UNIT, ANALOGUE, 0, [round(float(number) * FULL_SCALE)])
        elif word.isdecimal() and int(word) < POINTS:
            (is_on, *_) = await server.async_getValues(UNIT, DISCRETE, int(word), 1)
            await server.async_setValues(UNIT, DISCRETE, int(word), [not is_on])
            print(f"discrete {word} {'off' if is_on else 'on'}", flush=True)
        else:
            print(f"{word!r} is no input: 0 to {POINTS - 1}, air BAR, or q", flush=True)
    await server.shutdown()


async def written(
    function: int, _start: int, address: int, _count: int, _now: list[int], values: list | None
) -> None:
    """Print what is written to coils."""
    if function in WRITES and values is not None:
        for number, is_on in enumerate(values, address):
            print(f"coil {number} {'on' if is_on else 'off'}", flush=True)


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("host")
arguments.add_argument("port", type=int)
asyncio.run(main(**vars(arguments.parse_args())))
