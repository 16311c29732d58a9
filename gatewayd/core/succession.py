# ruff: noqa: SLF001 - the successor of a cell is the other half of it: what one keeps to itself the other takes over
"""A cell with a new definition takes the place of a running one, between two events, so that nobody notices.

What has the same name and the same place in the robot goes on: value, time, quality, availability; a lock with the same
members keeps its owner and lease, a writer its life and connections. The rest is released first, by the old
definition's fallbacks, so that nothing is ever owned that nobody could release.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from gatewayd.core.cell import Cell, LastRefusal
from gatewayd.core.definition import OPERATOR, CellDefinition, Direction, FallbackKind, Lock, Variable
from gatewayd.core.events import Event

__all__ = ["Succession", "succeed"]


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
    told of the new cell.
    """
    match = _Match(old.definition, definition)
    stranded = _release(old, match, now)
    old.forcing.lift()
    new = Cell(definition)
    new.image.succeed(old.image, match.variables)
    new.ownership.succeed(old.ownership, match.locks, match.writers, now)
    new.writers.succeed(old.writers, match.writers)
    _take_source(old, new)
    _take_history(old, new, match)
    _take_forcing(old, new, match)
    new.adoption.succeed(old.adoption)
    new.delivery.succeed(old.delivery, new.health, match.variables, match.due)
    new._next_heartbeat = old._next_heartbeat
    return Succession(new, stranded)


class _Match:
    """Indices of what goes on: old -> new."""

    def __init__(self, old: CellDefinition, new: CellDefinition) -> None:
        variables = {_identity(variable): index for index, variable in enumerate(new.variables)}
        self.variables = {
            index: variables[_identity(variable)]
            for index, variable in enumerate(old.variables)
            if _identity(variable) in variables
        }
        writers = {writer.name: index for index, writer in enumerate(new.writers)}
        self.writers = {
            index: writers[writer.name] for index, writer in enumerate(old.writers) if writer.name in writers
        }
        self.writers[OPERATOR] = OPERATOR
        locks = {lock.name: index for index, lock in enumerate(new.locks)}
        self.locks = {
            index: locks[lock.name]
            for index, lock in enumerate(old.locks)
            if lock.name in locks and self._same_members(lock, new.locks[locks[lock.name]])
        }
        self.places = {
            _place(variable): index
            for index, variable in enumerate(new.variables)
            if variable.direction is Direction.INPUT
        }
        """Registers that somebody will write, and by which variable."""
        self.old, self.new = old, new

    def _same_members(self, old: Lock, new: Lock) -> bool:
        return {self.variables.get(member) for member in old.members} == set(new.members)

    def may_keep(self, lock: int, owner: int) -> bool:
        """Whether the owner of an old lock may go on owning it."""
        successor = self.locks.get(lock)
        return successor is not None and (
            owner == OPERATOR or self.writers.get(owner) in self.new.locks[successor].owners
        )

    def due(self, variables: set[int]) -> Iterator[int]:
        """New indices of those inputs; what owes its register a fallback owes it under another name too."""
        for index in variables:
            successor = self.variables.get(index, self.places.get(_place(self.old.variables[index])))
            if successor is not None:
                yield successor


def _identity(variable: Variable) -> tuple[object, ...]:
    """What has to be the same for a value to go on; limits, policies and addresses may differ."""
    return variable.name, variable.direction, variable.kind, *_place(variable)


def _place(variable: Variable) -> tuple[object, ...]:
    return variable.field, variable.bit, variable.element


# -- before: what disappears is released -----------------------------------------------------------------------------


def _release(old: Cell, match: _Match, now: float) -> tuple[str, ...]:
    old.operator.release_expired(now)
    detail = "not the same in the new mapping"
    owners = enumerate(old.ownership.owners)
    ending = [lock for lock, owner in owners if owner is not None and not match.may_keep(lock, owner)]
    forces = [index for index in old.forcing.forces if not _force_goes_on(match, index)]
    old.operator.end(forces, ending, now, detail)
    gone = _inputs_without_successor(match)
    released = {member for lock in ending for member in old.ownership.locks[lock].members}
    if old.accepts_writes:
        old._fallbacks.apply(
            [index for index in gone if index not in released and old.image.available[index]], now
        )
        old._notify(Direction.INPUT)
    owed = (old.definition.variables[index] for index in gone if index in old.delivery.owed)
    return tuple(variable.name for variable in owed if variable.on_release.kind is not FallbackKind.HOLD)


def _force_goes_on(match: _Match, index: int) -> bool:
    lock = match.old.variables[index].lock
    return index in match.variables and (lock is None or lock in match.locks)


def _inputs_without_successor(match: _Match) -> list[int]:
    """Inputs whose register nobody would write any more, so that nobody could ever clear it."""
    return [
        index
        for index, variable in enumerate(match.old.variables)
        if variable.direction is Direction.INPUT and _place(variable) not in match.places
    ]


# -- after: what stays is taken over ---------------------------------------------------------------------------------


def _take_source(old: Cell, new: Cell) -> None:
    new.freshness.succeed(old.freshness)
    new.lag.succeed(old.lag)
    new.health = replace(old.health)


def _take_history(old: Cell, new: Cell, match: _Match) -> None:
    new.events._events.extend(_translated(event, match) for event in old.events)
    new.events.count = old.events.count
    last = old.last_refusal
    if last is not None:
        refusal = replace(
            last.refusal,
            variable=_at(match.variables, last.refusal.variable),
            holder=_at(match.writers, last.refusal.holder),
        )
        new.last_refusal = LastRefusal(refusal, _at(match.writers, last.writer), last.time, last.peer)
    for (writer, variable, reason), told in old._refusals._told.items():
        if (writer is None or writer in match.writers) and (variable is None or variable in match.variables):
            key = _at(match.writers, writer), _at(match.variables, variable), reason
            told.last = _translated(told.last, match) if told.last is not None else None
            new._refusals._told[key] = told
        elif told.last is not None:
            # What is gone is refused nothing any more, but what was only counted has to be told.
            new.events.append(_translated(replace(told.last, repeats=told.untold - 1), match))
    new._refusals._next = old._refusals._next


def _take_forcing(old: Cell, new: Cell, match: _Match) -> None:
    former, forcing = old.forcing, new.forcing
    forcing.forces.update({match.variables[index]: force for index, force in former.forces.items()})
    forcing.holds.update({match.locks[lock]: until for lock, until in former.holds.items()})
    forcing.next_due = former.next_due
    forcing.lay()


def _at(indices: Mapping[int, int], index: int | None) -> int | None:
    return None if index is None else indices.get(index)


def _translated(event: Event, match: _Match) -> Event:
    """The event with the new indices; of what is gone the name is kept in the detail."""
    former = event.variable, event.lock, event.writer, event.other
    indices = (
        _at(match.variables, event.variable),
        _at(match.locks, event.lock),
        _at(match.writers, event.writer),
        _at(match.writers, event.other),
    )
    if indices == former:
        return event
    variable, lock, writer, other = indices
    detail = ", ".join(filter(None, (event.detail, *_names_gone(event, match))))
    return replace(event, variable=variable, lock=lock, writer=writer, other=other, detail=detail)


def _names_gone(event: Event, match: _Match) -> Iterator[str]:
    definition = match.old
    if event.variable is not None and event.variable not in match.variables:
        yield f"variable {definition.variables[event.variable].name}, since removed"
    elif event.variable is None and event.lock is not None and event.lock not in match.locks:
        yield f"lock {definition.locks[event.lock].name}, since removed"
    for role, writer in (("writer", event.writer), ("other", event.other)):
        if writer is not None and writer not in match.writers:
            yield f"{role} {definition.writers[writer].name}, since removed"
