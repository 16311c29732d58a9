"""Which promises of a running mapping a new one would weaken: supervision, limits, owners.

A promise is what the rest of the machine was built on. A reload may strengthen it at any time; a weaker one needs
somebody who says so (`gatewayd reload --force`). What every writer may own (`any`) promises nobody to be the only one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from gatewayd.core.definition import CellDefinition, Direction, Variable, Writer

__all__ = ["weakened"]


def weakened(old: CellDefinition, new: CellDefinition) -> Iterator[str]:
    """Each promise that would be weaker, in words; parts are matched by name. What is removed promises nothing."""
    writers = {writer.name: writer for writer in new.writers}
    for writer in old.writers:
        if writer.name in writers:
            yield from _supervision(writer, writers[writer.name])
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
    return [definition.writers[owner].name for owner in definition.locks[variable.lock].owners]


def _endless(seconds: float | None) -> float:
    return math.inf if seconds is None else seconds


def _seconds(seconds: float | None) -> str:
    return "none" if seconds is None else f"{seconds:g} s"
