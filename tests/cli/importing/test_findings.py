"""Findings as commands print them."""

from __future__ import annotations

from gatewayd.cli.importing.findings import FindingKind, ImportFinding


def test_place_kind_and_hint() -> None:
    found = ImportFinding(3, 5, "`x` cannot be read here", FindingKind.DOUBT, "write a number")
    assert list(found.lines("a.csv")) == [
        "a.csv:3:5: doubt: `x` cannot be read here",
        "    hint: write a number",
    ]
    assert not found.is_error


def test_a_whole_line_of_one_of_several_files() -> None:
    assert str(ImportFinding(3, 0, "no", file="b.xml")) == "b.xml:3: error: no"
