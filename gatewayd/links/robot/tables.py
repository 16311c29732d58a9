"""What the robot's kind shows of a mapping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from gatewayd.core.definition import Direction
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.layout import Column, Row
from gatewayd.report.wording import family


class RobotTables(LinkTables):
    """One column: what a variable is in the robot."""

    key = KIND.key
    columns = (Column("robot", before="unit"),)
    screen = (Column("robot", before="value", coloured=True),)
    page = (Column("robot", before="value"),)

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """`input_bit_register_5`, `actual_TCP_pose[0]`."""
        return {variable.index: [{"robot": variable.target}] for variable in cell.variables}

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """With the way that the value goes."""
        arrow = "->" if first.direction == Direction.INPUT.value else "<-"
        return {"robot": f"{arrow} {family(first['robot'], last['robot'])}"}


TABLES: Final = RobotTables()
