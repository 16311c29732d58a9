"""What a mapping says of its controller, as the rules need it."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.robot.reference import UnresolvedReference
from gatewayd.links.robot.sections import RobotSection
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.model import VariableSpec
from gatewayd.rtde.fields import Series, SoftwareVersion


def controller(document: Document) -> tuple[Series | None, SoftwareVersion | None]:
    """What the file says of the controller; the series may follow from the version."""
    robot = document.part(RobotSection)
    if robot is None:
        return None, None
    version = SoftwareVersion(*robot.spec.version) if robot.spec.version is not None else None
    if robot.spec.series is not None:
        series = Series.from_word(robot.spec.series)
        # A version of another series is a finding of its own and says nothing about fields.
        return series, version if version is not None and version.major == series.major else None
    return (Series.from_major(version.major), version) if version is not None else (None, None)


def watchdog_field(document: Document) -> tuple[str, Position] | None:
    """The field that is fed, and the place that names it."""
    robot = document.part(RobotSection)
    if robot is None or robot.spec.watchdog is None:
        return None
    return robot.spec.watchdog.field, robot.at("watchdog", "field")


def unresolved(cell: ExpandedCell) -> Iterator[tuple[Part[VariableSpec], UnresolvedReference]]:
    """The lines that name nothing in the robot, and why."""
    for item in cell.unresolved:
        if isinstance(item.error, UnresolvedReference):
            yield item.part, item.error
