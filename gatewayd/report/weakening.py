"""Which promises of a running mapping a new one would weaken: supervision, limits, owners.

A promise is what the rest of the machine was built on. A reload may strengthen it at any time; a weaker one needs
somebody who says so (`gatewayd reload --force`). What every writer may own (`any`) promises nobody to be the only one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from gatewayd.core.definition import CellDefinition, Direction, Lock, Variable, Writer


def weakened(old: CellDefinition, new: CellDefinition) -> Iterator[str]:
    """Each promise that would be weaker, in words; parts are matched by name. What is removed promises nothing."""
    writers = {writer.name: writer for writer in new.writers}
    for writer in old.writers:
        if writer.name in writers:
            yield from _supervision(writer, writers[writer.name])
    if _endless(new.adopt_for) > _endless(old.adopt_for):
        yield f"adopted values would be kept longer: adopt_for {_seconds(old.adopt_for)} -> {_seconds(new.adopt_for)}"
    yield from _locks(old, new)
    variables = {variable.name: variable for variable in new.variables}
    for variable in old.variables:
        successor = variables.get(variable.name)
        if successor is not None and variable.direction is successor.direction is Direction.INPUT:
            yield from _limits(variable, successor)
            yield from _owners(variable, successor, old, new)


def _supervision(old: Writer, new: Writer) -> Iterator[str]:
    for what, before, after in (
        ("timeout", old.timeout, new.timeout),
        ("heartbeat", old.heartbeat, new.heartbeat),
    ):
        if _endless(after) > _endless(before):
            yield f"`{old.name}` would be missed later: {what} {_seconds(before)} -> {_seconds(after)}"
    if old.counts_writes and not new.counts_writes and old.timeout is not None:
        yield f"`{old.name}` would be missed later: reads would feed its timeout too"
    if new.grace > old.grace:
        yield f"`{old.name}` would keep its locks without a connection: grace {old.grace:g} s -> {new.grace:g} s"


def _locks(old: CellDefinition, new: CellDefinition) -> Iterator[str]:
    locks = {lock.name: lock for lock in new.locks}
    for lock in old.locks:
        after = locks.get(lock.name)
        # Who else may own it is a reason for another lease.
        if after is None or _names(lock, old) != _names(after, new):
            continue
        if _endless(after.lease) > _endless(lock.lease):
            before = _seconds(lock.lease)
            yield f"`{lock.name}` would be kept longer for a silent owner: lease {before} -> {_seconds(after.lease)}"
        if lock.whole and not after.whole:
            yield f"`{lock.name}` could be taken over in part"


def _limits(old: Variable, new: Variable) -> Iterator[str]:
    if old.limits is None:
        return
    low, high = (-math.inf, math.inf) if new.limits is None else (new.limits.low, new.limits.high)
    if low < old.limits.low or high > old.limits.high:
        after = "none" if new.limits is None else f"{low:g}..{high:g}"
        yield f"`{old.name}` could be written beyond its limits: {old.limits.low:g}..{old.limits.high:g} -> {after}"


def _owners(old: Variable, new: Variable, before: CellDefinition, after: CellDefinition) -> Iterator[str]:
    owners = _may_own(old, before)
    more = [name for name in _may_own(new, after) if name not in owners]
    if more and len(owners) < len(before.writers):
        yield f"`{old.name}` could be owned by {', '.join(more)} too"


def _may_own(variable: Variable, definition: CellDefinition) -> list[str]:
    if variable.lock is None:
        return []
    return _names(definition.locks[variable.lock], definition)


def _names(lock: Lock, definition: CellDefinition) -> list[str]:
    return [definition.writers[owner].name for owner in lock.owners]


def _endless(seconds: float | None) -> float:
    return math.inf if seconds is None else seconds


def _seconds(seconds: float | None) -> str:
    return "none" if seconds is None else f"{seconds:g} s"
