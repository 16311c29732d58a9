"""Record every package into a file that the official client's reader takes: python record.py HOST PORT FILE SECONDS."""

import argparse
import asyncio
from pathlib import Path

from gatewayd import rtde
from gatewayd.rtde.recording import create_recording

FIELDS = ["timestamp", "actual_q", "actual_TCP_pose", "runtime_state", "robot_mode"]


async def main(host: str, port: int, file: Path, seconds: float) -> None:
    async with rtde.connect(host, port=port, outputs=FIELDS) as robot:
        first = await robot.newer(timeout=2)
        with create_recording(file, robot.outputs) as recording:
            async for sample in robot:
                recording.write(sample.values)
                if sample.timestamp - first.timestamp >= seconds:
                    break
        print(f"{recording.packages} packages, {robot.statistics.skipped} skipped by the controller")


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("host")
arguments.add_argument("port", type=int)
arguments.add_argument("file", type=Path)
arguments.add_argument("seconds", type=float)
asyncio.run(main(**vars(arguments.parse_args())))
