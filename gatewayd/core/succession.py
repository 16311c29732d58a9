"""A cell with a new definition takes the place of a running one, between two events, so that nobody notices.

What has the same name and the same place in the robot goes on: value, time, quality, availability; a lock with the same
members keeps its owner and lease, a writer its life and connections. The rest is released first, by the old
definition's fallbacks, so that nothing is ever owned that nobody could release.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, FallbackKind
from gatewayd.core.image import Quality
from gatewayd.core.match import Match


@dataclass(frozen=True, slots=True)
class Succession:
    """What came of it."""

    cell: Cell
    """The new cell, without listeners."""
    stranded: tuple[str, ...]
    """Inputs that are gone and of which the robot keeps what it holds, for nobody could clear it any more."""


def succeed(old: Cell, definition: CellDefinition, now: float, *, same_robot: bool = True) -> Succession:
    """The cell that goes on with `definition` where `old` stands now. `old` must not be used for anything afterwards.

    Releases and last fallbacks happen in `old`, whose listeners hear of them: let the robot have them before it is
    handed the new cell.
    """
    match = Match(old.definition, definition, same_robot=same_robot)
    stranded = _release(old, match, now)
    new = Cell(definition)
    new.succeed(old, match, now)
    return Succession(new, stranded)


def losing(cell: Cell, match: Match) -> list[int]:
    """The locks whose owners would not go on owning them."""
    owners = enumerate(cell.ownership.owners)
    return [lock for lock, owner in owners if owner is not None and not match.may_keep(lock, owner)]


def left_behind(cell: Cell, match: Match) -> Iterator[int]:
    """Inputs of which the robot would keep a value that nobody could clear any more.

    It cannot be given the fallback now, or the policy is to hold what is not zero. The same before the release and
    after it.
    """
    for index in match.inputs_without_successor():
        variable, value = cell.definition.variables[index], cell.image.values[index]
        fallback, holds = variable.on_release, variable.on_release.kind is FallbackKind.HOLD
        if cell.accepts_writes and cell.image.available[index]:
            left = holds and value != variable.kind.zero
        else:
            known = cell.image.quality[index] not in (Quality.NEVER, Quality.UNAVAILABLE)
            active = value != variable.kind.zero and (holds or value != fallback.value)
            left = (index in cell.delivery.owed and not holds) or (known and active)
        if left:
            yield index


def _release(old: Cell, match: Match, now: float) -> tuple[str, ...]:
    """What ends is released in the old cell. Returns the inputs that could not be cleared."""
    old.operator.release_expired(now)
    detail = "not the same in the new mapping" if match.same_robot else "another robot in the new mapping"
    ending = losing(old, match)
    forces = [index for index in old.forcing.forces if not match.force_goes_on(index)]
    old.operator.end(forces, ending, now, detail)
    gone = match.inputs_without_successor()
    released = {member for lock in ending for member in old.ownership.locks[lock].members}
    if old.accepts_writes:
        old.fall_back([index for index in gone if index not in released and old.image.available[index]], now)
    return tuple(old.definition.variables[index].name for index in left_behind(old, match))
