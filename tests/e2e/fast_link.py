"""A robot link that does not wait between connections, for controllers that end them on purpose.

python -m tests.e2e.fast_link MAPPING LOSSES
    Prints how many sessions there were, and the memory used after a third, two thirds and all of the losses.
"""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.robot.plan import robot_of
from gatewayd.links.robot.runtime import RobotLink
from gatewayd.mapping.loader import load
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.loss import Loss
from gatewayd.rtde.session import ClientSettings


def resident_kilobytes() -> int:
    """Memory that this process occupies now (VmRSS)."""
    status = Path("/proc/self/status").read_text("ascii")
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS:")))


class Enough(Exception):
    pass


class FastLink(RobotLink):
    """Counts its losses, ends after the last."""

    def __init__(self, path: Path, losses: int) -> None:
        plan = load(path.read_bytes(), str(path)).plan
        assert plan is not None
        self.cell = Cell(plan.cell)
        super().__init__(robot_of(plan), self.cell)
        robot = robot_of(plan)
        settings = ClientSettings(
            host=robot.host,
            port=robot.port,
            outputs=robot.outputs,
            inputs=robot.inputs,
            handshake_timeout=0.05,
            data_timeout=0.1,
            first_data_timeout=0.1,
            backoff=0.0,
            backoff_limit=0.0,
        )
        self._client = RtdeClient(settings, self)
        self._wanted = losses
        self._losses = 0
        self.sizes: list[int] = []

    def session_lost(self, loss: Loss) -> None:
        super().session_lost(loss)
        self._losses += 1
        self.cell.tick(time.monotonic())
        if self._losses % (self._wanted // 3) == 0:
            self.sizes.append(resident_kilobytes())
        if self._losses >= self._wanted:
            raise Enough


async def main() -> None:
    link = FastLink(Path(sys.argv[1]), int(sys.argv[2]))
    try:
        await link.run()
    except Enough:
        print(link.cell.health.sessions, *link.sizes, flush=True)


if __name__ == "__main__":
    asyncio.run(main())
