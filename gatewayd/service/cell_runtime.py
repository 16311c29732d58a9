"""One robot cell with its links: made from a plan, and carried over to another plan by a reload."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.succession import Succession, succeed
from gatewayd.links.contract import Context, Link, SharedPart, SourceLink
from gatewayd.links.registry import kind_of, runtime_of
from gatewayd.logs.events import EventLog
from gatewayd.mapping.plan import Plan


class CellRuntime:
    """One cell with its links, while it is served. A reload puts other ones in their place."""

    def __init__(
        self,
        plan: Plan,
        state: Path,
        now: float,
        shared: Callable[[str], SharedPart | None] = lambda _kind: None,
    ) -> None:
        """`state`: directory of what the cell keeps across restarts; `shared`: what links share, by their kind."""
        self.plan = plan
        self._state = state
        self._shared = shared
        self.cell = self._set_up(Cell(plan.cell))
        self.links: dict[str, Link] = {name: self._make(name, now) for name in plan.links}

    @property
    def source(self) -> SourceLink:
        """The link that values come from."""
        return next(link for link in self.links.values() if isinstance(link, SourceLink))

    @property
    def reachable(self) -> bool:
        """Whether a writer can reach the cell; one without a fieldbus waits for none."""
        found = [link.reachable for link in self.links.values() if link.reachable is not None]
        return any(found) or not found

    def of_kind(self, kind: str) -> list[Link]:
        """Its links of one kind."""
        return [link for name, link in self.links.items() if self.plan.links[name].kind == kind]

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: the cell judges the time first, then its links."""
        self.cell.gap(since, now)
        for link in self.links.values():
            link.gap(since, now)

    def succeed(self, plan: Plan, now: float) -> tuple[str, ...]:
        """Go on with another plan, by the same links where that can be; names of inputs left as they were."""
        before, former = self.plan, self.links
        staying = {name for name in plan.links if name in former and _fits(name, before, plan)}
        for name, link in former.items():
            if name not in staying:
                link.release(now)
        succession = self._hand_over(plan.cell, now)
        self.plan, self.links = plan, {}
        self.cell = self._set_up(succession.cell)
        for name, link_plan in plan.links.items():
            if name in staying:
                former[name].rebind(link_plan, self.cell, now)
                self.links[name] = former[name]
            else:
                self.links[name] = self._make(name, now, former.get(name))
        return succession.stranded

    def retire(self, now: float) -> tuple[str, ...]:
        """Release everything for good; names of inputs left as they were."""
        return self._hand_over(replace(self.plan.cell, variables=(), locks=(), writers=()), now).stranded

    def _hand_over(self, definition: CellDefinition, now: float) -> Succession:
        """End the cell: links send what falls due by that, and nobody listens to it any more."""
        former = self.cell
        succession = succeed(former, definition, now)
        for link in self.links.values():
            link.flush(now)
        former.listeners.clear()
        former.events.listeners.clear()
        former.write_listeners.clear()
        return succession

    def _set_up(self, cell: Cell) -> Cell:
        cell.events.listeners.append(EventLog(cell))
        return cell

    def _make(self, name: str, now: float, former: Link | None = None) -> Link:
        plan = self.plan.links[name]
        context = Context(now, self._state, self._shared(plan.kind), former)
        return runtime_of(plan.kind).make(plan, self.cell, context)


def _fits(name: str, before: Plan, after: Plan) -> bool:
    old, new = before.links[name], after.links[name]
    return old.kind == new.kind and kind_of(new.kind).fits(old, new, before.cell, after.cell)
