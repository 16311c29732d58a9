"""Rules GW518 and GW519: groups that several writers own by turns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gatewayd.core.definition import FallbackKind
from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLock, ExpandedVariable
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.wording import names_and_more


@cell_rule("GW518", Severity.WARNING)
def inherited_value(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A held variable that the next owner of its group inherits."""
    for lock in _taken_over(cell):
        held = [member for member in _members(cell, lock) if member.spec.on_release.kind is FallbackKind.HOLD]
        if lock.whole or not held:
            continue
        assert lock.group is not None
        first, higher = held[0], lock.owners[0]
        message = f"`{higher}` takes over the group `{lock.name}` and inherits the value of {_names(held)}"
        related = (Related(lock.group.key, f"the group `{lock.name}`"),)
        hint = f"write `on_release: clear` or a value at `{first.part.name}`, or `whole: true` at the group"
        yield rule.at(first.at("on_release"), message, hint=hint, related=related)


@cell_rule("GW519", Severity.WARNING)
def split_group(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A group that no single request can take over whole."""
    for lock in _taken_over(cell):
        members = _members(cell, lock)
        for name in lock.owners[:-1]:
            writer = cell.document.writers[name].spec
            if any(language.writes_whole(writer, members, cell) for language in languages()):
                continue
            assert lock.group is not None
            message = f"`{name}` cannot take over the group `{lock.name}` with one request"
            apart = (language.apart(members, cell) for language in languages())
            related = tuple(place for place in apart if place is not None)[:1]
            hint = "lay its variables side by side, or write `takeover: false`"
            yield rule.at(lock.group.key, message, hint=hint, related=related)
            break


def _taken_over(cell: ExpandedCell) -> Iterator[ExpandedLock]:
    """Groups of several variables that a writer takes from another."""
    for lock in cell.locks:
        if lock.group is not None and lock.takeover and len(lock.owners) > 1 and len(lock.members) > 1:
            yield lock


def _members(cell: ExpandedCell, lock: ExpandedLock) -> list[ExpandedVariable]:
    return [cell.variables[index] for index in lock.members]


def _names(variables: Iterable[ExpandedVariable]) -> str:
    return names_and_more(list(dict.fromkeys(variable.part.name for variable in variables)))
