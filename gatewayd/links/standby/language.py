"""The part of the mapping language that concerns a second gateway."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar, Final

from gatewayd.links.language import LinkLanguage
from gatewayd.links.standby.declaration import KIND
from gatewayd.links.standby.plan import StandbyPlan
from gatewayd.links.standby.sections import Standby
from gatewayd.mapping.document import Document
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.section import Section


class StandbyLanguage(LinkLanguage):
    """Section `standby`."""

    key = KIND.key
    section = Standby
    meaning = "a second gateway for the same robot"
    rules = ("gatewayd.links.standby.rules.pair", "gatewayd.links.standby.rules.takeover")
    articles: ClassVar[Mapping[type[Section], str]] = {Standby: "the section `standby`"}
    telling_keys = ("peer", "address", "grace")

    def adopt_for(self, document: Document) -> Iterable[float | None]:
        """`grace`, in place of what the robot's section says: every takeover begins it anew."""
        part = document.part(Standby)
        return () if part is None else (part.spec.grace,)

    def compile(self, cell: ExpandedCell) -> StandbyPlan:
        """Where the other gateway is."""
        part = cell.document.part(Standby)
        assert part is not None
        standby = part.spec
        return StandbyPlan(
            peers=tuple((peer.host, peer.port) for peer in standby.peer),
            listen=(standby.listen.host, standby.listen.port) if standby.listen is not None else None,
            address=standby.address or "",
        )


LANGUAGE: Final = StandbyLanguage()
