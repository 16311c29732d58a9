"""The benchmarks' report: judgements, percentiles, histograms; and that every subject is there."""

from __future__ import annotations

from importlib import import_module

import pytest

from tests.benchmarks.__main__ import SUBJECTS
from tests.benchmarks.report import Table, at_least, at_most, histogram, percentile


def test_a_figure_is_judged_by_its_aim() -> None:
    assert at_most(0.25, 0.3, " ms") == "0.25 ms (aim <= 0.3 ms: met)"
    assert at_most(0.35, 0.3, " ms") == "0.35 ms (aim <= 0.3 ms: MISSED)"
    assert at_least(0.85, 0.85) == "0.85 (aim >= 0.85: met)"
    assert at_least(0.8, 0.85) == "0.8 (aim >= 0.85: MISSED)"


def test_percentile_of_unordered_values() -> None:
    values = [float(value) for value in reversed(range(1, 101))]
    assert percentile(values, 0.5) == 51
    assert percentile(values, 0.99) == 100
    assert percentile([7.0], 0.99) == 7


def test_histogram_counts_every_value_once() -> None:
    rows = histogram([0.0001, 0.0002, 0.0002, 0.009], [0.1, 0.2, 1])
    assert [(name, share.strip()) for name, share, _ in rows] == [
        ("<= 0.1 ms", "25.0 %"),
        ("<= 0.2 ms", "50.0 %"),
        ("<= 1 ms", "0.0 %"),
        ("> 1 ms", "25.0 %"),
    ]
    assert max(len(bar) for _, _, bar in rows) == 40


def test_table_aligns_its_columns() -> None:
    table = Table("Title", "What it means.", ("what", "figure"))
    table.add("a long name", "1")
    table.add("b")
    assert str(table).splitlines() == [
        "Title",
        "=====",
        "What it means.",
        "",
        "what         figure",
        "-------------------",
        "a long name  1",
        "b",
    ]


@pytest.mark.parametrize("subject", SUBJECTS)
def test_every_subject_can_be_run(subject: str) -> None:
    assert callable(import_module(f"tests.benchmarks.{subject}").run)
