"""Columns at their places."""

from __future__ import annotations

from gatewayd.report.layout import Column, arranged, plain, span


def test_columns_stand_where_they_say() -> None:
    """Before a known one, else last; one name is one column."""
    own = [Column("a"), Column("z")]
    further = [
        Column("b", "z"),
        Column("c", "z"),
        Column("y"),
        Column("b", whole=False),
        Column("x", "unknown"),
    ]
    assert [column.name for column in arranged(own, further)] == ["a", "b", "c", "z", "y", "x"]
    assert arranged(own, further)[1].whole


def test_values_and_spans_as_text() -> None:
    assert [plain(value) for value in (None, True, 0, 1.5, "x")] == ["", "true", "0", "1.5", "x"]
    assert (span("1", "1"), span("1", "9")) == ("1", "1-9")
