"""What a kind of link shows of a mapping: the part of the contract for `gatewayd show`.

A kind that has only `columns` and `rows` is in every form of the table with them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.plan import Plan
from gatewayd.report.layout import Column, ReportTable, Row, plain, span


class LinkTables:
    """One kind's columns and tables. A cell and a plan are those of a mapping without errors."""

    key: ClassVar[str]
    """Of the kind."""
    columns: ClassVar[tuple[Column, ...]] = ()
    """Of the rows in CSV and JSON: names that no other kind has."""
    screen: ClassVar[tuple[Column, ...] | None] = None
    """Of the table on a screen; None: the same. Kinds may share one: the first with a text for it has it."""
    page: ClassVar[tuple[Column, ...] | None] = None
    """Of the table in a document; None: the same as in CSV."""
    notes: ClassVar[tuple[str, ...]] = ()
    """Lines below the table on a screen, for cells with such a link."""

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """By index of the variable: what its columns hold, once for each of the variable's places."""
        return {}

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """Texts of the columns on a screen, for the first and the last variable of a line."""
        return {
            column.name: span(plain(first[column.name]), plain(last[column.name])) for column in self.columns
        }

    def on_page(self, row: Row) -> Mapping[str, str]:
        """Texts of the columns in a document."""
        return {column.name: plain(row[column.name]) for column in self.columns}

    def conversion(self, row: Row) -> str:
        """How the number at its place becomes the robot's value: `raw * 0.1`; empty for one to one."""
        return ""

    def headline(self, plan: Plan) -> str:
        """Where the cell is by this kind, for the line above the table."""
        return ""

    def introduction(self, plan: Plan) -> str:
        """The same as a sentence, for a document."""
        return ""

    def screen_table(self, cell: ExpandedCell) -> ReportTable | None:
        """A table of its own below that of the variables, on a screen."""
        return None

    def page_table(self, cell: ExpandedCell) -> ReportTable | None:
        """The same in a document."""
        return self.screen_table(cell)

    def legend(self, cell: ExpandedCell) -> Iterable[str]:
        """What the numbers of its variables mean, where they stand for states: a line each, below the tables."""
        return ()

    def document(self, plan: Plan, cell: ExpandedCell) -> object:
        """What JSON has of the link besides the columns, under its key."""
        return {}
