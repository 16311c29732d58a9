"""Record every package into a file that the official client's reader takes: python record.py HOST PORT FILE SECONDS."""

import asyncio
import sys
from pathlib import Path

from gatewayd import rtde
from gatewayd.rtde.recording import create_recording

FIELDS = ["timestamp", "actual_q", "actual_TCP_pose", "runtime_state", "robot_mode"]


async def main(host: str, port: str, file: str, seconds: str) -> None:
    async with rtde.connect(host, port=int(port), outputs=FIELDS) as robot:
        first = await robot.newer(timeout=2)
        with create_recording(Path(file), robot.outputs) as recording:
            async for sample in robot:
                recording.write(sample.values)
                if sample.timestamp - first.timestamp >= float(seconds):
                    break
        print(f"{recording.packages} packages, {robot.statistics.skipped} skipped by the controller")


asyncio.run(main(*sys.argv[1:]))
