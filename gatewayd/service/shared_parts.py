"""What the links of several cells use together, one part for each kind of link that has such a thing."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping, Sequence

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection
from gatewayd.links.contract import Prepared, PrepareError, SharedPart
from gatewayd.links.registry import runtime_of
from gatewayd.mapping.plan import Plan
from gatewayd.service.cell_runtime import CellRuntime


class AllPrepared:
    """What all parts have ready."""

    def __init__(self) -> None:
        self.each: list[Prepared] = []

    def commit(self) -> None:
        """Have all of it in use by the next `SharedParts.serve`."""
        for prepared in self.each:
            prepared.commit()

    async def abort(self) -> None:
        """Give all of it back."""
        await asyncio.gather(*(prepared.abort() for prepared in self.each))


class SharedParts:
    """The parts by key of the kind; made when the first link of a kind is."""

    def __init__(self) -> None:
        self._parts: dict[str, SharedPart | None] = {}

    def of(self, kind: str) -> SharedPart | None:
        """What the links of this kind share; None: nothing."""
        if kind not in self._parts:
            self._parts[kind] = runtime_of(kind).share()
        return self._parts[kind]

    def items(self) -> Iterator[tuple[str, SharedPart]]:
        """The parts, each with the key of its kind."""
        return ((kind, part) for kind, part in self._parts.items() if part is not None)

    def __iter__(self) -> Iterator[SharedPart]:
        return (part for part in self._parts.values() if part is not None)

    def progress(self) -> dict[str, int]:
        """A counter for each thing that has to go on."""
        return {name: count for part in self for name, count in part.progress().items()}

    def troubles(self) -> list[str]:
        """What concerns the gateway as a whole."""
        return [trouble for part in self for trouble in part.troubles()]

    def disturbs(self, plans: Sequence[Plan]) -> Iterator[tuple[Cell, Objection]]:
        """What these plans would take from who uses the parts, each with the cell that it concerns."""
        return (found for part in self for found in part.disturbs(plans))

    async def refresh(self) -> tuple[str, ...]:
        """Look at files beside the mappings; returns what is wrong with them."""
        return tuple([problem for part in self for problem in await part.refresh()])

    async def prepare(self, plans: Sequence[Plan]) -> AllPrepared:
        """Have ready what these plans need. Raises PrepareError, and nothing has changed."""
        for plan in plans:
            for link in plan.links.values():
                self.of(link.kind)
        found = AllPrepared()
        try:
            for part in self:
                found.each.append(await part.prepare(plans))
        except PrepareError:
            await found.abort()
            raise
        return found

    def serve(self, runtimes: Sequence[CellRuntime], successors: Mapping[Cell, Cell]) -> None:
        """Serve the links of these cells, and no others."""
        for kind, part in self._parts.items():
            if part is not None:
                part.serve([link for runtime in runtimes for link in runtime.of_kind(kind)], successors)

    async def close(self) -> None:
        """Take nothing more."""
        await asyncio.gather(*(part.close() for part in self))
