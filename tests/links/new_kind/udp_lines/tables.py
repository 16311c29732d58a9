"""What `show` has of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.layout import Column

from .declaration import KIND
from .language import ExpandedLines


class LinesTables(LinkTables):
    """The name that lines have for each variable."""

    key = KIND.key
    columns = (Column("lines"),)

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """One name for each."""
        lines = cell.link(ExpandedLines)
        return {} if lines is None else {one.index: [{"lines": name}] for one, name, _ in lines.names}


TABLES = LinesTables()
