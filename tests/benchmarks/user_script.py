"""The script that people write instead of using a gateway: ur_rtde receives, a stock pymodbus server serves.

`python user_script.py HOST PORT`: integers and doubles of the robot on the addresses of the full image, as far as
ur_rtde lets one have them (12 to 19 of 0 to 23). It is a fair one: one recipe at the full rate, one call for each
block, nothing per register.
"""

from __future__ import annotations

import asyncio
import struct
import sys

import rtde_receive
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

REGISTERS = range(12, 20)
INTEGERS_AT = 210 + 2 * 12
DOUBLES_AT = 300 + 4 * 12
WRITE = 16


async def _serve(host: str, port: int) -> None:
    names = [f"output_{kind}_register_{number}" for kind in ("int", "double") for number in REGISTERS]
    robot = rtde_receive.RTDEReceiveInterface(host, 500.0, names)
    device = SimDevice(1, [SimData(0, count=1000, values=0, datatype=DataType.REGISTERS)])
    server = ModbusTcpServer(device, address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    while True:
        integers = struct.pack(">8i", *(robot.getOutputIntRegister(number) for number in REGISTERS))
        doubles = struct.pack(">8d", *(robot.getOutputDoubleRegister(number) for number in REGISTERS))
        await server.async_setValues(1, WRITE, INTEGERS_AT, list(struct.unpack(">16H", integers)))
        await server.async_setValues(1, WRITE, DOUBLES_AT, list(struct.unpack(">32H", doubles)))
        await asyncio.sleep(0.002)


if __name__ == "__main__":
    asyncio.run(_serve(sys.argv[1], int(sys.argv[2])))
