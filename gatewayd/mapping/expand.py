"""From the parts of a document to concrete variables and locks, and to each link's side of the cell.

Ranges, vectors and bits become single variables; types, leases and owners become explicit. What cannot be
expanded is kept as `Unresolved`, or by its link.
"""

from __future__ import annotations

import dataclasses
from typing import Final

from gatewayd.core.definition import Direction
from gatewayd.links.registry import definer, languages
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import (
    Defined,
    ExpandedCell,
    ExpandedLock,
    ExpandedVariable,
    UndefinedError,
    Unresolved,
)
from gatewayd.mapping.model import ANY, Group, VariableSpec

SHARED_LEASE: Final = 5.0
"""Seconds of lease where several writers may own and the file says nothing."""
_MANY: Final = 2048
"""Some way beyond the limit of variables of a cell."""


def expand(document: Document) -> ExpandedCell:
    """Expand the variables of a document. Never raises, whatever valid parts it holds.

    Stops some way beyond the limit of variables, so that no file can fill the memory with them.
    """
    builder = _Builder(document)
    for part in document.variables.values():
        if len(builder.variables) > _MANY:
            break
        builder.add(part)
    return builder.finished()


class _Builder:
    def __init__(self, document: Document) -> None:
        self.document = document
        self.variables: list[ExpandedVariable] = []
        self.unresolved: list[Unresolved] = []
        self._members: list[list[int]] = []
        self._locks: dict[str | int, int] = {}
        """Which lock a group has, or a variable without a group."""

    def add(self, part: Part[VariableSpec]) -> None:
        try:
            values, family = definer().define(part, self.document)
        except UndefinedError as error:
            self.unresolved.append(Unresolved(part, error))
            return
        for member, value in enumerate(values):
            index = len(self.variables)
            variable = ExpandedVariable(
                **{name: getattr(value, name) for name in _DEFINED},
                index=index,
                name=f"{part.name}[{member}]" if family else part.name,
                part=part,
                member=member if family else None,
                lock=self._lock_index(part, index) if value.direction is Direction.INPUT else None,
            )
            self.variables.append(variable)

    def finished(self) -> ExpandedCell:
        links = {language.key: language.expand(self.document, self.variables) for language in languages()}
        return ExpandedCell(
            self.document,
            tuple(self.variables),
            tuple(self._lock(index) for index in range(len(self._members))),
            tuple(self.unresolved),
            definer().settings(self.document),
            {key: link for key, link in links.items() if link is not None},
        )

    def _lock_index(self, part: Part[VariableSpec], index: int) -> int | None:
        group = part.spec.group
        if group is not None and group not in self.document.groups:
            return None
        lock = self._locks.setdefault(index if group is None else group, len(self._members))
        if lock == len(self._members):
            self._members.append([])
        self._members[lock].append(index)
        return lock

    def _lock(self, index: int) -> ExpandedLock:
        members = tuple(self._members[index])
        line = self.variables[members[0]].part
        group = self.document.groups[line.spec.group] if line.spec.group is not None else None
        declared: Part[Group] | Part[VariableSpec] = group if group is not None else line
        spec = declared.spec
        names = spec.owner or (ANY,)
        is_any = names == (ANY,)
        writers = self.document.writers
        owners = tuple(writers) if is_any else tuple(dict.fromkeys(name for name in names if name in writers))
        shared = is_any or len(names) > 1
        lease = spec.lease if "lease" in spec.model_fields_set else SHARED_LEASE if shared else None
        takeover = spec.takeover if spec.takeover is not None else shared and not is_any
        name = group.name if group is not None else self.variables[members[0]].name
        position = declared.at("owner") if spec.owner is not None else declared.key
        whole = group is not None and group.spec.whole
        return ExpandedLock(name, members, owners, is_any, takeover, lease, whole, group, position)


_DEFINED: Final = tuple(field.name for field in dataclasses.fields(Defined))
