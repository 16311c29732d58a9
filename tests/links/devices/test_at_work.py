"""Tasks of shared parts: begun with the group or in it, begun again after a defect, ended for good."""

from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest

from gatewayd.links.devices import at_work
from gatewayd.links.devices.at_work import Work, WorkGroup, end_all


async def test_work_runs_with_its_group_and_ends_for_good() -> None:
    begun = asyncio.Queue[str]()

    def work(name: str) -> Work:
        async def run() -> None:
            begun.put_nowait(name)
            await asyncio.get_running_loop().create_future()

        return Work(name, run)

    early, late, group = work("early"), work("late"), WorkGroup()
    group.begin(early)
    assert early.task is None
    running = asyncio.create_task(group.run(lambda: [early]))
    assert await asyncio.wait_for(begun.get(), 5) == "early"
    group.begin(late)
    group.begin(late)
    assert await asyncio.wait_for(begun.get(), 5) == "late"
    tasks = [early.task, late.task]
    await end_all([early, late])
    assert all(task is not None and task.done() for task in tasks)
    assert begun.empty()
    running.cancel()
    with suppress(asyncio.CancelledError):
        await running


async def test_a_defect_is_waited_for_with_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(at_work, "RETRY_PERIOD", 0.01)
    again = asyncio.Event()

    async def run() -> None:
        if work.rests:
            again.set()
        raise ValueError("a defect")

    work, group = Work("work", run), WorkGroup()
    running = asyncio.create_task(group.run(lambda: [work]))
    await asyncio.wait_for(again.wait(), 5)
    running.cancel()
    with suppress(asyncio.CancelledError):
        await running
