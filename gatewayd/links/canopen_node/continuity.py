"""Whether a running node can go on with another plan, and what its peers rely on.

| of the plan | may be otherwise |
|---|---|
| objects of variables | more of them |
| TPDOs | more of them; more at the end of one (receivers use its first bytes); inhibit and event time |
| RPDOs | more of them; the deadline |
| heartbeats, guarding of writers | how long, ours and those that are watched; not whose |
| autostart, inhibit time of EMCY | yes |
| everything else | no: the node boots anew, so that its master looks at it again |
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.canopen_node.description import by_name
from gatewayd.links.canopen_node.plan import CanopenPlan, PdoPlan

_JUDGED = ("objects", "pdos", "consumers", "guarded", "heartbeat", "autostart", "emcy_inhibit")
"""Fields of a plan that are looked into; all others have to be the same."""

Pdos = Mapping[tuple[Direction, int], PdoPlan]


def goes_on(old: CanopenPlan, new: CanopenPlan, before: CellDefinition, after: CellDefinition) -> bool:
    """Whether nothing that a peer relies on is different."""
    return (
        _rest(old, before) == _rest(new, after)
        and _watched(old, before) == _watched(new, after)
        and _objects(old, before) <= _objects(new, after)
        and _pdos_go_on(old, new, before, after)
    )


def weakened(old: CanopenPlan, new: CanopenPlan) -> Iterator[str]:
    """What its peers could rely on less, in words."""
    if _longer(old.heartbeat, new.heartbeat):
        times = f"{_time(old.heartbeat)} -> {_time(new.heartbeat)}"
        yield f"the loss of node {old.node} would be noticed later: heartbeat {times}"
    successors = _pdos(new)
    for (direction, number), pdo in _pdos(old).items():
        successor = successors.get((direction, number))
        if (
            direction is Direction.INPUT
            and successor is not None
            and pdo.cob_id == successor.cob_id
            and _longer(pdo.event, successor.event)
        ):
            times = f"{_time(pdo.event)} -> {_time(successor.event)}"
            yield f"the loss of RPDO {number} would be noticed later: deadline {times}"


def _rest(plan: CanopenPlan, cell: CellDefinition) -> dict[str, str]:
    return {key: text for key, text in by_name(plan, cell).items() if key not in _JUDGED}


def _watched(plan: CanopenPlan, cell: CellDefinition) -> list[dict[str, str]]:
    return [by_name(replace(consumer, timeout=0), cell) for consumer in (*plan.consumers, *plan.guarded)]


def _objects(plan: CanopenPlan, cell: CellDefinition) -> set[tuple[str, ...]]:
    return {tuple(by_name(placed, cell).values()) for placed in plan.objects}


def _pdos(plan: CanopenPlan) -> Pdos:
    return {(pdo.direction, pdo.number): pdo for pdo in plan.pdos}


def _pdos_go_on(old: CanopenPlan, new: CanopenPlan, before: CellDefinition, after: CellDefinition) -> bool:
    successors = _pdos(new)
    for key, pdo in _pdos(old).items():
        if key not in successors:
            return False
        successor = successors[key]
        if pdo.direction is Direction.OUTPUT:
            successor = replace(successor, entries=successor.entries[: len(pdo.entries)])
        if _layout(pdo, before) != _layout(successor, after):
            return False
    return True


def _layout(pdo: PdoPlan, cell: CellDefinition) -> dict[str, str]:
    """What the frames are; its name is the file's."""
    return by_name(replace(pdo, inhibit=0, event=0, name=""), cell)


def _longer(old: int, new: int) -> bool:
    """Of times of which 0 is none."""
    return old != 0 and (new == 0 or new > old)


def _time(milliseconds: int) -> str:
    return f"{milliseconds} ms" if milliseconds else "none"
