"""What the daemon needs of this kind of link: each family makes its links, and shares its lines among them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection
from gatewayd.links.contract import Context, Link, LinkRuntime, Prepared, PrepareError, SharedPart, Tap
from gatewayd.links.devices.families import runtime_of_family
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.mapping.plan import LinkPlan, Plan


class FamilyParts(SharedPart):
    """What the families share, each among its own links; made when the first device of a family is."""

    def __init__(self) -> None:
        self._parts: dict[str, SharedPart] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._group: asyncio.TaskGroup | None = None
        self._tap: Tap | None = None

    def of(self, family: str) -> SharedPart:
        """What the links of a family share."""
        if family not in self._parts:
            part = self._parts[family] = runtime_of_family(family).share()
            part.trace(self._tap)
            self._begin(family)
        return self._parts[family]

    async def run(self) -> None:
        """Have the parts of all families work until cancelled."""
        async with asyncio.TaskGroup() as group:
            self._group = group
            try:
                for family in self._parts:
                    self._begin(family)
                await asyncio.get_running_loop().create_future()
            finally:
                self._group = None

    def progress(self) -> Mapping[str, int]:
        """What the parts of the families count."""
        return {name: count for part in self._parts.values() for name, count in part.progress().items()}

    def troubles(self) -> Sequence[str]:
        """What concerns more than one device."""
        return [trouble for part in self._parts.values() for trouble in part.troubles()]

    def gap(self, since: float, now: float) -> None:
        """Answers may have waited."""
        for part in self._parts.values():
            part.gap(since, now)

    def trace(self, tap: Tap | None) -> None:
        """What passes the lines."""
        self._tap = tap
        for part in self._parts.values():
            part.trace(tap)

    async def prepare(self, plans: Sequence[Plan]) -> Prepared:
        """Have ready what each family needs."""
        for plan in plans:
            for device in _devices(plan):
                self.of(device.family)
        found: list[Prepared] = []
        try:
            for part in self._parts.values():
                found.append(await part.prepare(plans))  # noqa: PERF401 - those before a failure are given back
        except PrepareError:
            for prepared in found:
                await prepared.abort()
            raise
        return _AllPrepared(found)

    def disturbs(self, plans: Sequence[Plan]) -> Iterator[tuple[Cell, Objection]]:
        """What the families object to."""
        for part in self._parts.values():
            yield from part.disturbs(plans)

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Each family its own links."""
        for family, part in self._parts.items():
            own = [link for link in links if isinstance(link.plan, DevicePlan) and link.plan.family == family]
            part.serve(own, successors)

    async def close(self) -> None:
        """Nothing comes from any device any more."""
        await asyncio.gather(*(part.close() for part in self._parts.values()))

    def _begin(self, family: str) -> None:
        if self._group is not None and family not in self._tasks:
            work = self._parts[family].run()
            self._tasks[family] = self._group.create_task(work, name=f"devices: {family}")


class _AllPrepared:
    """What the families have ready."""

    def __init__(self, parts: Sequence[Prepared]) -> None:
        self._parts = parts

    def commit(self) -> None:
        """See Prepared."""
        for part in self._parts:
            part.commit()

    async def abort(self) -> None:
        """See Prepared."""
        for part in self._parts:
            await part.abort()


class DeviceRuntime(LinkRuntime):
    """Links of all families."""

    def share(self) -> FamilyParts:
        """What each family shares."""
        return FamilyParts()

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> Link:
        """A link of the plan's family."""
        assert isinstance(plan, DevicePlan)
        assert isinstance(context.shared, FamilyParts)
        shared = context.shared.of(plan.family)
        return runtime_of_family(plan.family).make(plan, cell, replace(context, shared=shared))


def _devices(plan: Plan) -> Iterable[DevicePlan]:
    return plan.of(DevicePlan).values()


RUNTIME = DeviceRuntime()
"""What the daemon needs of this kind of link."""
