"""Rules GW856 to GW858: whether there is a dashboard server, and what it knows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from gatewayd.links.robot.dashboard.rules.commands import section_of
from gatewayd.links.robot.dashboard.variables import VIA, name_of
from gatewayd.links.robot.rules.controller import controller
from gatewayd.links.robot.sections import RobotSection
from gatewayd.mapping.diagnostics import Diagnostic, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.rtde.fields import Series, SoftwareVersion

_SINCE: Final[Mapping[str, Mapping[Series, SoftwareVersion]]] = {
    "unlock": {Series.CB3: SoftwareVersion(3, 1), Series.E: SoftwareVersion(5, 0)},
    "remote_control": {Series.E: SoftwareVersion(5, 6)},
}
"""What not all software knows, and from which on."""


@cell_rule("GW856")
def dashboard_not_declared(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A command or state of a dashboard server that the file does not open."""
    robot = cell.document.part(RobotSection)
    if robot is None or section_of(cell.document) is not None:
        return
    for variable in cell.variables:
        if variable.via == VIA:
            message = f"`{variable.name}` is of the dashboard server, which this mapping does not open"
            hint = "add `dashboard: {}` to the section `robot`, if programs are to be started from here"
            yield rule.at(variable.at("dashboard"), message, hint=hint)


@cell_rule("GW857")
def dashboard_of_polyscope_x(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The dashboard server of a PolyScope X controller, which has none."""
    robot, (series, _version) = cell.document.part(RobotSection), controller(cell.document)
    if robot is not None and robot.spec.dashboard is not None and series is Series.X:
        message = "PolyScope X has no dashboard server"
        hint = "start programs by its Robot API instead, and exchange values by registers; remove `dashboard`"
        yield rule.at(robot.key_at("dashboard"), message, hint=hint)


@cell_rule("GW858")
def dashboard_not_in_version(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A command or state that the controller software does not know."""
    series, version = controller(cell.document)
    if series is None or series is Series.X:
        return
    for variable in cell.variables:
        since = _SINCE.get(name_of(variable.field)) if variable.via == VIA else None
        if since is None:
            continue
        first = since.get(series)
        if first is not None and (version is None or version >= first):
            continue
        shown = f"software {version}" if version is not None else "any software"
        message = (
            f"`{variable.name}`: {shown} of series {series.word} does not know {name_of(variable.field)}"
        )
        hint = f"it exists from {first} on" if first is not None else "no version of this series has it"
        yield rule.at(variable.at("dashboard"), message, hint=hint)
