"""Print the joint angles of every package: python read.py HOST [PORT] [PACKAGES]."""

import asyncio
import sys

from gatewayd import rtde


async def main(host: str, port: str = "30004", packages: str = "5") -> None:
    left = int(packages)
    async with rtde.connect(host, port=int(port), outputs=["timestamp", "actual_q"]) as robot:
        print(f"controller {robot.version}, {robot.frequency:g} packages per second")
        async for sample in robot:
            print(f"{sample.timestamp:.3f} s", *(f"{angle:.4f}" for angle in sample.actual_q))
            left -= 1
            if not left:
                break


asyncio.run(main(*sys.argv[1:]))
