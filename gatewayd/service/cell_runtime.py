"""One robot cell with its links: made from a plan, and carried over to another plan by a reload."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.match import Match
from gatewayd.core.succession import Succession, left_behind, losing, succeed
from gatewayd.links.contract import Context, DutyLink, Link, SharedPart, SourceLink
from gatewayd.links.registry import kind_of, runtime_of
from gatewayd.logs.events import EventLog
from gatewayd.mapping.plan import LinkPlan, Plan
from gatewayd.service.silent_link import SilentLink


@dataclass(frozen=True, slots=True)
class Losses:
    """What a reload would take from owners and leave in the robot."""

    locks: Mapping[int, str]
    """Locks that would be released, and why."""
    forces: Sequence[int]
    """Variables whose force would end."""
    left: Sequence[int]
    """Inputs of which the robot would keep a value that nobody could clear any more."""


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
        self.serving = not _has_duty(plan)
        """Whether all of its links run; else only those that do so while another gateway serves the cell."""
        self.cell = self._set_up(Cell(plan.cell))
        self.links: dict[str, Link] = {name: self._make(name, now) for name in plan.links}

    @property
    def source(self) -> SourceLink:
        """The link that values come from."""
        return next(link for link in self.links.values() if isinstance(link, SourceLink))

    @property
    def duty(self) -> DutyLink | None:
        """The link that decides whether the cell is served here; None: it always is."""
        return next((link for link in self.links.values() if isinstance(link, DutyLink)), None)

    @property
    def reachable(self) -> bool:
        """Whether a writer can reach the cell; one without a fieldbus waits for none."""
        if not self.serving:
            return False
        found = [link.reachable for link in self.links.values() if link.reachable is not None]
        return any(found) or not found

    def of_kind(self, kind: str) -> list[Link]:
        """Its links of one kind, as far as they run."""
        return [
            link
            for name, link in self.links.items()
            if self.plan.links[name].kind == kind and not isinstance(link, SilentLink)
        ]

    def take_over(self, now: float) -> None:
        """Serve the cell: the links that were silent are there now, and do nothing before their `run`."""
        self.serving = True
        self.cell.standing_by = ""
        for name, link in self.links.items():
            if isinstance(link, SilentLink):
                self.links[name] = self._make(name, now)

    def stand_by(self, why: str, now: float) -> None:
        """Serve the cell no more, and leave the robot what it holds: the other gateway adopts it.

        Forces end first, as they do not go over. What is released then reaches no robot any more, and is owed to none.
        """
        self.cell.operator.end(self.cell.forcing.forces, (), now, why)
        self.source.flush(now)
        self.source.withdraw_claim(why, now)
        former = self.links
        self._release(None, self.plan.cell, now)
        self.cell = self._set_up(self._hand_over(self.plan.cell, now, same_robot=False).cell)
        self.serving = False
        self.cell.standing_by = why
        self.links = {name: self._make(name, now, link) for name, link in former.items()}

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: the cell judges the time first, then its links."""
        self.cell.gap(since, now)
        for link in self.links.values():
            link.gap(since, now)

    def losses(self, plan: Plan | None) -> Losses:
        """What `succeed`, or `retire` for None, would take and leave now. Changes nothing."""
        after = plan.cell if plan is not None else self._nothing
        match = Match(self.cell.definition, after, same_robot=self._same_robot(plan))
        why = "not the same in the new mapping" if match.same_robot else "its robot would be another one"
        locks = dict.fromkeys(losing(self.cell, match), why)
        for name, link in self.links.items():
            departing = link.departing(self._next(name, plan), after)
            for lock in self.cell.following(departing):
                owner, connection = self.cell.ownership.owners[lock], self.cell.ownership.connections[lock]
                reasons = {who.connection: why for who, why in departing.items() if who.writer == owner}
                locks.setdefault(lock, reasons.get(connection) or next(iter(reasons.values())))
        if plan is not None and self._comes_to_stand_by(plan):
            for lock, owner in enumerate(self.cell.ownership.owners):
                if owner is not None:
                    locks.setdefault(lock, "of two gateways the one that claims the robot serves the cell")
        forces = [index for index in self.cell.forcing.forces if not match.force_goes_on(index)]
        return Losses(locks, forces, tuple(left_behind(self.cell, match)))

    def succeed(self, plan: Plan, now: float) -> tuple[str, ...]:
        """Go on with another plan, by the same links where that can be; names of inputs left as they were."""
        stands_by = self._comes_to_stand_by(plan)
        former, same_robot = self.links, self._same_robot(plan) and not stands_by
        self.serving = (self.serving and not stands_by) or not _has_duty(plan)
        staying = {name for name in former if self._next(name, plan) is not None}
        self._release(plan, plan.cell, now)
        succession = self._hand_over(plan.cell, now, same_robot=same_robot)
        standing_by = self.cell.standing_by
        self.plan, self.links = plan, {}
        self.cell = self._set_up(succession.cell)
        self.cell.standing_by = "" if self.serving else standing_by
        for name, link_plan in plan.links.items():
            if name in staying:
                former[name].rebind(link_plan, self.cell, now)
                self.links[name] = former[name]
            else:
                self.links[name] = self._make(name, now, former.get(name))
        return succession.stranded

    def retire(self, now: float) -> tuple[str, ...]:
        """Release everything for good; names of inputs left as they were."""
        self._release(None, self._nothing, now)
        return self._hand_over(self._nothing, now, same_robot=True).stranded

    @property
    def _nothing(self) -> CellDefinition:
        return replace(self.plan.cell, variables=(), locks=(), writers=())

    def _comes_to_stand_by(self, plan: Plan) -> bool:
        """Whether the plan adds a second gateway: which of the two serves the cell is open then."""
        return _has_duty(plan) and not _has_duty(self.plan)

    def _same_robot(self, plan: Plan | None) -> bool:
        return plan is None or not any(
            kind_of(old.kind).moved(old, new) for old, new in self._pairs(plan) if old.kind == new.kind
        )

    def _pairs(self, plan: Plan) -> Iterator[tuple[LinkPlan, LinkPlan]]:
        return ((old, plan.links[name]) for name, old in self.plan.links.items() if name in plan.links)

    def _next(self, name: str, plan: Plan | None) -> LinkPlan | None:
        """The plan with which the link of this name goes on; None: it ends."""
        old, new = self.links[name].plan, plan.links.get(name) if plan is not None else None
        if plan is None or new is None or new.kind != old.kind or isinstance(self.links[name], SilentLink):
            return None
        if isinstance(self.links[name], SourceLink) and _has_duty(plan) is not _has_duty(self.plan):
            return None
        return new if kind_of(new.kind).fits(old, new, self.plan.cell, plan.cell) else None

    def _release(self, plan: Plan | None, after: CellDefinition, now: float) -> None:
        for name, link in self.links.items():
            link.release(self._next(name, plan), after, now)

    def _hand_over(self, definition: CellDefinition, now: float, *, same_robot: bool) -> Succession:
        """End the cell: links send what falls due by that, and nobody listens to it any more."""
        former = self.cell
        succession = succeed(former, definition, now, same_robot=same_robot)
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
        kind = kind_of(plan.kind)
        if not (self.serving or kind.stands_by):
            return SilentLink(plan, self.cell)
        if isinstance(former, DutyLink):
            former.rebind(plan, self.cell, now)
            return former
        context = Context(
            now, self._state, self._shared(plan.kind), on_request=_has_duty(self.plan), former=former
        )
        return runtime_of(plan.kind).make(plan, self.cell, context)


def standing_by(plan: Plan) -> Plan:
    """The plan with the links that run while another gateway serves the cell; all, where there is no other one."""
    if not _has_duty(plan):
        return plan
    links = {name: link for name, link in plan.links.items() if kind_of(link.kind).stands_by}
    return replace(plan, links=links)


def _has_duty(plan: Plan) -> bool:
    return any(kind_of(link.kind).decides for link in plan.links.values())
