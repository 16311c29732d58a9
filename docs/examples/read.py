"""Print the joint angles of every package: python read.py HOST [PORT] [PACKAGES]."""

import argparse
import asyncio

from gatewayd import rtde


async def main(host: str, port: int, packages: int) -> None:
    async with rtde.connect(host, port=port, outputs=["timestamp", "actual_q"]) as robot:
        print(f"controller {robot.version}, {robot.frequency:g} packages per second")
        async for sample in robot:
            print(f"{sample.timestamp:.3f} s", *(f"{angle:.4f}" for angle in sample.actual_q))
            packages -= 1
            if not packages:
                break


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("host")
arguments.add_argument("port", nargs="?", type=int, default=30004)
arguments.add_argument("packages", nargs="?", type=int, default=5)
asyncio.run(main(**vars(arguments.parse_args())))
