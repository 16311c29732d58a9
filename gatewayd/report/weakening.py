"""Which promises of a running mapping a new one would weaken: supervision, limits, owners.

A promise is what the rest of the machine was built on. A reload may strengthen it at any time; a weaker one needs
somebody who says so (`gatewayd reload --accept weakening`). What every writer may own (`any`) promises nobody to be the
only one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from gatewayd.core.definition import CellDefinition, Direction, FallbackKind, Lock, Variable, Writer
from gatewayd.report.format import interval


def weakened(old: CellDefinition, new: CellDefinition) -> Iterator[str]:
    """Each promise that would be weaker, in words; parts are matched by name. What is removed promises nothing."""
    writers = {writer.name: writer for writer in new.writers}
    for writer in old.writers:
        if writer.name in writers:
            yield from _supervision(writer, writers[writer.name])
    if _endless(new.adopt_for) > _endless(old.adopt_for):
        yield f"adopted values would be kept longer: adopt_for {_seconds(old.adopt_for)} -> {_seconds(new.adopt_for)}"
    if new.stale_after > old.stale_after:
        yield f"values would be stale later: stale_after {old.stale_after:g} s -> {new.stale_after:g} s"
    if old.clear_on_connect and not new.clear_on_connect:
        yield "inputs without an owner would keep what the controller holds: on_connect adopt"
    yield from _locks(old, new)
    variables = {variable.name: variable for variable in new.variables}
    for variable in old.variables:
        successor = variables.get(variable.name)
        if successor is None or variable.direction is not successor.direction:
            continue
        yield from _fallbacks(variable, successor)
        if variable.direction is Direction.INPUT:
            yield from _limits(variable, successor)
            yield from _owners(variable, successor, old, new)


def _supervision(old: Writer, new: Writer) -> Iterator[str]:
    for what, before, after in (
        ("timeout", old.timeout, new.timeout),
        ("heartbeat", old.heartbeat, new.heartbeat),
    ):
        if _endless(after) > _endless(before):
            yield f"the loss of `{old.name}` would be noticed later: {what} {_seconds(before)} -> {_seconds(after)}"
    if old.counts_writes and not new.counts_writes and old.timeout is not None:
        yield f"the loss of `{old.name}` would be noticed later: reads would feed its timeout too"
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
    for lock in old.locks:
        after = locks.get(lock.name)
        if after is not None:
            yield from _priority(lock, _outranks(lock, old), _outranks(after, new), _names(after, new))


def _priority(
    lock: Lock, before: set[tuple[str, str]], after: set[tuple[str, str]], owners: list[str]
) -> Iterator[str]:
    lost = sorted(pair for pair in before - after if set(pair) <= set(owners))
    if lost:
        higher, lower = lost[0]
        yield f"`{higher}` could no longer take `{lock.name}` over from `{lower}`"


def _outranks(lock: Lock, definition: CellDefinition) -> set[tuple[str, str]]:
    """Pairs of writers of which the first may take the lock over from the second."""
    names = _names(lock, definition) if lock.takeover else []
    return set(combinations(names, 2))


def _fallbacks(old: Variable, new: Variable) -> Iterator[str]:
    for what, before, after in (
        ("on_release", old.on_release, new.on_release),
        ("on_stale", old.on_stale, new.on_stale),
    ):
        if after.kind is FallbackKind.HOLD and before.kind is not FallbackKind.HOLD:
            yield f"`{old.name}` would hold its value: {what} hold"
    if old.valid_running and not new.valid_running:
        yield f"`{old.name}` would be good while the robot program does not run: valid"


def _limits(old: Variable, new: Variable) -> Iterator[str]:
    if old.limits is None:
        return
    low, high = (-math.inf, math.inf) if new.limits is None else (new.limits.low, new.limits.high)
    if low < old.limits.low or high > old.limits.high:
        after = "none" if new.limits is None else interval(low, high)
        before = interval(old.limits.low, old.limits.high)
        yield f"`{old.name}` could be written beyond its limits: {before} -> {after}"
    elif new.limits is not None and new.limits.clamp and not old.limits.clamp:
        yield f"`{old.name}` would be brought to its limits where it is refused today: clamp"


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
