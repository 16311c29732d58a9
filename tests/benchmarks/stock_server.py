"""pymodbus's own server over 1000 registers, as its documentation shows it: `python stock_server.py PORT`."""

from __future__ import annotations

import asyncio
import sys

from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice


async def _serve(port: int) -> None:
    device = SimDevice(1, [SimData(0, count=1000, values=0, datatype=DataType.REGISTERS)])
    await ModbusTcpServer(device, address=("127.0.0.1", port)).serve_forever()


if __name__ == "__main__":
    asyncio.run(_serve(int(sys.argv[1])))
