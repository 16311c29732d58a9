"""The dashboard server's part of the mapping language. Its section is in `robot`, whose kind defines its variables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from gatewayd.links.language import LinkLanguage
from gatewayd.links.robot.dashboard.declaration import KIND
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.dashboard.sections import DashboardPlace
from gatewayd.links.robot.sections import RobotSection
from gatewayd.mapping.document import Document
from gatewayd.mapping.expanded import ExpandedCell


class DashboardLanguage(LinkLanguage):
    """The key `dashboard` of variables."""

    key = KIND.key
    section = None
    variable_keys = DashboardPlace
    rules = ("gatewayd.links.robot.dashboard.rules.commands", "gatewayd.links.robot.dashboard.rules.server")

    def concerns(self, document: Document) -> bool:
        """Also where the section is there without a variable."""
        robot = document.part(RobotSection)
        return (robot is not None and robot.spec.dashboard is not None) or super().concerns(document)

    def compile_links(self, cell: ExpandedCell) -> Mapping[str, DashboardPlan]:
        """One link, if the section is there."""
        part = cell.document.part(RobotSection)
        if part is None or part.spec.dashboard is None:
            return {}
        section = part.spec.dashboard
        programs = tuple(sorted((int(number), file) for number, file in section.programs.items()))
        return {self.key: DashboardPlan(part.spec.host, section.port, section.poll, programs)}


LANGUAGE: Final = DashboardLanguage()
