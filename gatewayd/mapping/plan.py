"""The compiled mapping: everything the links need, worked out once, immutable.

`gatewayd.mapping.compile` makes it; `gatewayd.service.daemon` hands its parts to the core and to the links. It travels
between processes (pickle), and equals what it was there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, TypeVar

from gatewayd.core.definition import CellDefinition

NO_MEANING: Mapping[str, bool] = {"meaning": False}
"""Metadata of a field of a link's plan that does not count for the fingerprint: it is there for words only."""


class LinkPlan:
    """One link of a cell, compiled: a frozen dataclass of the link's own that fits into a pickle.

    All of its fields count for the fingerprint but those at their default and those with `NO_MEANING`; a part that has
    a `meaning` (JSON's types) counts with that.
    """

    __slots__ = ()
    kind: ClassVar[str]
    """Key of the kind of link that makes links of it."""


_LinkPlan = TypeVar("_LinkPlan", bound=LinkPlan)


@dataclass(frozen=True, slots=True)
class Plan:
    """One robot cell, compiled."""

    source: str
    """Path of the mapping file as given."""
    cell: CellDefinition
    links: Mapping[str, LinkPlan] = field(default_factory=dict)
    """By name of the link; one that a section of its own declares has the key of that."""

    @property
    def kinds(self) -> frozenset[str]:
        """Keys of the kinds of its links."""
        return frozenset(link.kind for link in self.links.values())

    def of(self, kind: type[_LinkPlan]) -> dict[str, _LinkPlan]:
        """The links of one kind by name."""
        return {name: plan for name, plan in self.links.items() if isinstance(plan, kind)}

    def the(self, kind: type[_LinkPlan]) -> _LinkPlan:
        """The only link of one kind; ValueError if there is none, or more."""
        (found,) = self.of(kind).values()
        return found

    def with_links(self, **links: LinkPlan) -> Plan:
        """The same cell with these links in place of those of the same names."""
        return replace(self, links={**self.links, **links})
