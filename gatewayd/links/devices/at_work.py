"""What the devices of all cells share, kept at work: a task for each connection or bus, begun again after a defect."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass

from gatewayd.loop.retry import keep_running

RETRY_PERIOD = 2.0
"""Seconds after which work that ended in a defect is started again."""

log = logging.getLogger("gatewayd.devices")


@dataclass(eq=False, slots=True)
class Work:
    """One connection, or one bus, as a task."""

    name: str
    run: Callable[[], Awaitable[None]]
    rests: int = 0
    """Progress while it waits after a defect."""
    task: asyncio.Task[None] | None = None

    def end(self) -> None:
        """Let it go on no more."""
        if self.task is not None:
            self.task.cancel()
            self.task = None

    def rest(self) -> None:
        """It waits after a defect, and does not hang."""
        self.rests += 1


class WorkGroup:
    """The tasks of one shared part. Work that is begun before it runs starts with it."""

    def __init__(self) -> None:
        self._group: asyncio.TaskGroup | None = None

    async def run(self, works: Callable[[], Iterable[Work]]) -> None:
        """Keep these at work, and whatever is begun meanwhile, until cancelled."""
        async with asyncio.TaskGroup() as group:
            self._group = group
            try:
                for work in works():
                    self.begin(work)
                await asyncio.get_running_loop().create_future()
            finally:
                self._group = None

    def begin(self, work: Work) -> None:
        """Have it at work, if anything is."""
        if self._group is None or work.task is not None:
            return
        keeping = keep_running(work.run, log, RETRY_PERIOD, work.rest)
        work.task = self._group.create_task(keeping, name=work.name)


async def end_all(works: Iterable[Work]) -> None:
    """End these, and wait until they have."""
    tasks = []
    for work in works:
        if work.task is not None:
            tasks.append(work.task)
        work.end()
    if tasks:
        await asyncio.wait(tasks)


class NothingPrepared:
    """There is nothing to take back: nothing that devices share has to be had before a mapping is served."""

    def commit(self) -> None:
        """See Prepared."""

    async def abort(self) -> None:
        """See Prepared."""
