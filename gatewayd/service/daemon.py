"""The daemon: one process, one loop, several robot cells.

A cell that fails costs that cell: a link whose task ends in an error is started again, what cannot be had is tried
again, and the others never notice. A core whose ticks fail is left to the watchdog: nobody would notice what only
time brings, and nothing may look fresh that nobody looks after.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Duty, Link, SharedPart, TapOf
from gatewayd.loop import clock
from gatewayd.loop.retry import keep_running
from gatewayd.mapping.plan import Plan
from gatewayd.service.cell_runtime import CellRuntime, standing_by
from gatewayd.service.shared_parts import AllPrepared, SharedParts

TICK = 0.02
"""Seconds between two looks at leases, time-outs and staleness."""
RETRY_PERIOD = 2.0
"""Seconds after which a part that failed is started again."""
CLOSING_TIME = 0.5
"""Seconds that the last packages to the robots may take when the daemon stops."""

log = logging.getLogger("gatewayd.daemon")


class Daemon:
    """Runs the cells of `plans` until asked to stop; `state` is the directory of what is kept across restarts."""

    def __init__(self, plans: Sequence[Plan], state: Path) -> None:
        self._state = state
        self.shared = SharedParts()
        self._group: asyncio.TaskGroup | None = None
        self._tasks: dict[object, asyncio.Task[None]] = {}
        """Of cells (their clocks), links and shared parts."""
        self._rests: Counter[object] = Counter()
        """Progress of parts that wait to be started again after an error."""
        self._observers: list[Callable[[Cell], None]] = []
        self.runtimes = [self._make(plan, clock.now()) for plan in plans]
        self.shared.serve(self.runtimes, {})

    @property
    def cells(self) -> list[Cell]:
        """The cells that are served now."""
        return [runtime.cell for runtime in self.runtimes]

    def observe(self, observer: Callable[[Cell], None]) -> None:
        """Call `observer` with every cell, now and whenever a reload brings one, before anybody writes to it."""
        self._observers.append(observer)
        for cell in self.cells:
            observer(cell)

    def progress(self) -> dict[str, int]:
        """A counter for each part that has to go on: shared parts, cores, links. 0: it has not begun."""
        found = self.shared.progress()
        for runtime in self.runtimes:
            cell = runtime.plan.cell.name
            found[f"core of {cell}"] = runtime.cell.health.heartbeat
            for name, link in runtime.links.items():
                if link.progress is not None:
                    own_name = "" if name == runtime.plan.links[name].kind else f" {name}"
                    found[f"{link.title}{own_name} of {cell}"] = link.progress + self._rests[link]
        return found

    def troubles(self) -> list[str]:
        """What concerns the gateway as a whole."""
        return self.shared.troubles()

    def trace(self, tap_of: TapOf | None) -> None:
        """Have everything that passes links and shared parts go through these taps; None: through none any more.

        To be called again where a reload may have brought others.
        """
        for runtime in self.runtimes:
            for name, link in runtime.links.items():
                kind = runtime.plan.links[name].kind
                link.trace(None if tap_of is None else tap_of(runtime.plan.cell.name, name, kind))
        for kind, part in self.shared.items():
            part.trace(None if tap_of is None else tap_of("", kind, kind))

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop` is set; then release every lock, give the robots the fallbacks, and close."""
        clock.on_gap(self._after_gap)
        async with asyncio.TaskGroup() as group:
            self._group = group
            for runtime in self.runtimes:
                self._begin_cell(runtime)
            self._begin_shared()
            await stop.wait()
            self._group = None
            await self._close()
            for task in list(self._tasks.values()):
                task.cancel()
        log.info("stopped")

    def _after_gap(self, gap: clock.Gap) -> None:
        """The process stood still; nothing that waited meanwhile has been served yet.

        Shared parts first: what a cell sends because of the gap has a part look at its time-outs.
        """
        for part in self.shared:
            part.gap(gap.since, gap.until)
        for runtime in self.runtimes:
            runtime.gap(gap.since, gap.until)

    # -- another mapping ---------------------------------------------------------------------------------------------

    @property
    def running(self) -> bool:
        """Whether there is anything to swap: false before `run` and once it stops."""
        return self._group is not None

    def served(self, plans: Sequence[Plan]) -> list[Plan]:
        """These plans with the links alone that would run now: what a cell that stands by needs, it needs later."""
        serving = {runtime.plan.cell.name for runtime in self.runtimes if runtime.serving}
        return [plan if plan.cell.name in serving else standing_by(plan) for plan in plans]

    def swap(self, plans: Sequence[Plan], now: float, prepared: AllPrepared | None = None) -> list[str]:
        """Serve these plans instead, between two packages; cells are known by their names. `prepared`: by `shared`.

        Links whose settings did not change stay up. Returns the inputs that are gone and could not be given their
        release fallback, as `cell: name`.
        """
        former = {runtime.plan.cell.name: runtime for runtime in self.runtimes}
        cells = {runtime: runtime.cell for runtime in self.runtimes}
        stranded: list[str] = []
        if prepared is not None:
            prepared.commit()
        # Whatever happens on the way, afterwards the shared parts serve the cells that there are.
        try:
            runtimes = [
                former.pop(plan.cell.name) if plan.cell.name in former else self._add(plan, now)
                for plan in plans
            ]
            for runtime, plan in zip(runtimes, plans, strict=True):
                if runtime.plan != plan:
                    stranded += [f"{plan.cell.name}: {name}" for name in self._replace(runtime, plan, now)]
            for runtime in former.values():
                stranded += [f"{runtime.plan.cell.name}: {name}" for name in runtime.retire(now)]
                for part in (runtime, *runtime.links.values()):
                    self._end(part)
            self.runtimes = runtimes
        finally:
            self._begin_shared()
            successors = {cell: runtime.cell for runtime, cell in cells.items() if runtime.cell is not cell}
            self.shared.serve(self.runtimes, successors)
        return stranded

    def _add(self, plan: Plan, now: float) -> CellRuntime:
        runtime = self._make(plan, now)
        self._show(runtime.cell)
        self._begin_cell(runtime)
        return runtime

    def _replace(self, runtime: CellRuntime, plan: Plan, now: float) -> tuple[str, ...]:
        former = dict(runtime.links)
        stranded = runtime.succeed(plan, now)
        self._show(runtime.cell)
        self._change(former, runtime.links)
        return stranded

    def _change(self, former: Mapping[str, Link], links: Mapping[str, Link]) -> None:
        """End the links that are gone, and begin those that are new; of one name one after the other."""
        gone = [name for name, link in former.items() if links.get(name) is not link]
        ended = {name: self._end(former[name]) for name in gone}
        for name, link in links.items():
            if link is not former.get(name):
                self._begin(link, link.run, ended.get(name))

    # -- which gateway serves a cell -----------------------------------------------------------------------------

    def _do_duty(self, runtime: CellRuntime, now: float) -> None:
        """Do what the cell's `DutyLink` says, if it has one."""
        link = runtime.duty
        if link is None:
            return
        duty = link.duty(runtime.source.claim, now)
        if duty.serve is not runtime.serving:
            self._turn(runtime, duty, now)
            return
        if not duty.serve:
            runtime.cell.standing_by = duty.why
        if duty.withdraw:
            runtime.source.withdraw_claim(duty.why, now)
        if duty.ask:
            runtime.source.ask_claim()

    def _turn(self, runtime: CellRuntime, duty: Duty, now: float) -> None:
        """Begin to serve the cell, or leave it."""
        former, cell = dict(runtime.links), runtime.cell
        if duty.serve:
            runtime.take_over(now)
        else:
            runtime.stand_by(duty.why, now)
            self._show(runtime.cell)
        self._change(former, runtime.links)
        self._begin_shared()
        successors = {cell: runtime.cell} if runtime.cell is not cell else {}
        self.shared.serve(self.runtimes, successors)

    def _show(self, cell: Cell) -> None:
        for observer in self._observers:
            observer(cell)

    # -- tasks -------------------------------------------------------------------------------------------------------

    def _make(self, plan: Plan, now: float) -> CellRuntime:
        return CellRuntime(plan, self._state, now, self.shared.of)

    def _begin_cell(self, runtime: CellRuntime) -> None:
        self._begin(runtime, partial(_tick, runtime, self._do_duty))
        for link in runtime.links.values():
            self._begin(link, link.run)

    def _begin_shared(self) -> None:
        for part in self.shared:
            if part not in self._tasks:
                self._begin(part, part.run)

    def _begin(
        self,
        part: CellRuntime | Link | SharedPart,
        work: Callable[[], Awaitable[None]],
        former: asyncio.Task[None] | None = None,
    ) -> None:
        """Have the part's work done, once a former task has ended. Before `run` it is left to that.

        Work that ends in an error is begun again, so that a defect in one cell never ends the process.
        """

        def progress() -> None:
            self._rests[part] += 1

        if self._group is not None:
            running = partial(keep_running, work, log, RETRY_PERIOD, progress)
            task = self._tasks[part] = self._group.create_task(_after(former, running))
            task.add_done_callback(lambda ended: self._forget(part, ended))

    def _forget(self, part: object, task: asyncio.Task[None]) -> None:
        if self._tasks.get(part) is task:
            del self._tasks[part]
            del self._rests[part]

    def _end(self, part: object) -> asyncio.Task[None] | None:
        """Have the part's work cancelled; returns its task, which still says goodbye."""
        task = self._tasks.pop(part, None)
        del self._rests[part]
        if task is not None:
            task.cancel()
        return task

    async def _close(self) -> None:
        """First nobody writes any more, then the robots get what the policies declare, then the links close."""
        await self.shared.close()
        now = clock.now()
        for runtime in self.runtimes:
            runtime.cell.stop(now, "the gateway stops")
        links = [link for runtime in self.runtimes for link in runtime.links.values()]
        with suppress(TimeoutError):
            async with asyncio.timeout(CLOSING_TIME):
                await asyncio.gather(*(link.close() for link in links))


async def _tick(runtime: CellRuntime, do_duty: Callable[[CellRuntime, float], None]) -> None:
    while True:
        now = clock.judged_now()
        do_duty(runtime, now)
        adoption = runtime.cell.adoption
        adoption.reachable = adoption.reachable or runtime.reachable
        runtime.cell.tick(now)
        await asyncio.sleep(TICK)


async def _after(former: asyncio.Task[None] | None, work: Callable[[], Awaitable[None]]) -> None:
    """Do the work once the former task has ended; if cancelled before, end after it all the same."""
    if former is not None:
        try:
            await asyncio.wait((former,))
        except asyncio.CancelledError:
            await asyncio.wait((former,))
            raise
    await work()
