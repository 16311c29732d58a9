"""A cell with a new definition takes the place of a running one, between two events, so that nobody notices.

What has the same name and the same place in the robot goes on: value, time, quality, availability; a lock with the same
members keeps its owner and lease, a writer its life and connections. The rest is released first, by the old
definition's fallbacks, so that nothing is ever owned that nobody could release.
"""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, FallbackKind
from gatewayd.core.match import Match


@dataclass(frozen=True, slots=True)
class Succession:
    """What came of it."""

    cell: Cell
    """The new cell, without listeners."""
    stranded: tuple[str, ...]
    """Inputs that are gone and could not be given their release fallback: the robot keeps what it holds."""


def succeed(old: Cell, definition: CellDefinition, now: float) -> Succession:
    """The cell that goes on with `definition` where `old` stands now. `old` must not be used for anything afterwards.

    Releases and last fallbacks happen in `old`, whose listeners hear of them: let the robot have them before it is
    handed the new cell.
    """
    match = Match(old.definition, definition)
    stranded = _release(old, match, now)
    new = Cell(definition)
    new.succeed(old, match, now)
    return Succession(new, stranded)


def _release(old: Cell, match: Match, now: float) -> tuple[str, ...]:
    """What ends is released in the old cell. Returns the inputs that could not be cleared."""
    old.operator.release_expired(now)
    detail = "not the same in the new mapping"
    owners = enumerate(old.ownership.owners)
    ending = [lock for lock, owner in owners if owner is not None and not match.may_keep(lock, owner)]
    forces = [index for index in old.forcing.forces if not match.force_goes_on(index)]
    old.operator.end(forces, ending, now, detail)
    gone = match.inputs_without_successor()
    released = {member for lock in ending for member in old.ownership.locks[lock].members}
    if old.accepts_writes:
        old.fall_back([index for index in gone if index not in released and old.image.available[index]], now)
    owed = (old.definition.variables[index] for index in gone if index in old.delivery.owed)
    return tuple(variable.name for variable in owed if variable.on_release.kind is not FallbackKind.HOLD)
