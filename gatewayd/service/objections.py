"""What of a new mapping must not happen to a running cell unasked, at this moment.

What its owners would lose and what the robot would keep, the runtime knows; what its links object to, their kinds; the
rest follows from the two mappings (`report.diff`, `report.weakening`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.links.registry import kind_of
from gatewayd.mapping.plan import Plan
from gatewayd.report.diff import ChangeKind, Changes, objections
from gatewayd.report.format import verb
from gatewayd.report.wording import names_and_more
from gatewayd.service.cell_runtime import CellRuntime, Losses


def objections_of_change(runtime: CellRuntime, changes: Changes) -> list[Objection]:
    """Why the cell must not go on with `changes.new`."""
    cell, losses = runtime.cell, runtime.losses(changes.new)
    owners = cell.ownership.owners
    kept = {
        variable.name
        for variable in cell.definition.variables
        if variable.lock is not None
        and owners[variable.lock] is not None
        and variable.lock not in losses.locks
    }
    return [
        *_losses(cell, losses, set(changes.of(ChangeKind.REMOVED))),
        *objections(changes, kept, numbers_used=cell.health.lock_requests > 0),
        *_of_links(runtime, changes.new),
    ]


def objections_of_removal(runtime: CellRuntime) -> list[Objection]:
    """Why the cell must not end."""
    gone = Objection(ObjectionKind.GONE, "the whole cell would be gone")
    return [gone, *_losses(runtime.cell, runtime.losses(None), ())]


def _losses(cell: Cell, losses: Losses, removed: Iterable[str]) -> Iterator[Objection]:
    variables, owners = cell.definition.variables, cell.ownership.owners
    removed = set(removed)
    found: dict[tuple[str, str], list[str]] = {}
    for lock, why in losses.locks.items():
        names, owner = [variables[index].name for index in cell.ownership.locks[lock].members], owners[lock]
        assert owner is not None
        by = cell.definition.writer_name(owner)
        what = "removed" if removed.issuperset(names) else f"released: {why}"
        found.setdefault((by, what), []).extend(names)
    for (by, what), names in found.items():
        yield Objection(ObjectionKind.RELEASE, f"{_are(names)} owned by {by} now and would be {what}")
    if losses.forces:
        names = [variables[index].name for index in losses.forces]
        yield Objection(ObjectionKind.RELEASE, f"{_are(names)} forced now, and the force would end")
    if losses.left:
        left = names_and_more([variables[index].name for index in losses.left])
        yield Objection(ObjectionKind.LEFT, f"the robot would keep what it holds in {left}")


def _of_links(runtime: CellRuntime, plan: Plan) -> Iterator[Objection]:
    for name, link in runtime.links.items():
        successor = plan.links.get(name)
        if successor is not None and successor.kind == link.plan.kind:
            kind = kind_of(successor.kind)
            yield from kind.disturbs(link.plan, successor, runtime.plan.cell, plan.cell)


def _are(names: list[str]) -> str:
    """`a` is; `a`, `b` and 3 more are."""
    return f"{names_and_more(names)} {verb('be', count=len(names))}"
