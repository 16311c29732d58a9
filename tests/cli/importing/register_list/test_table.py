"""Cells and their places."""

from __future__ import annotations

from gatewayd.cli.importing.register_list.findings import ListFindings
from gatewayd.cli.importing.register_list.table import decoded, table


def read(text: str) -> tuple[list[dict[str, tuple[str, int, int]]], list[str]]:
    findings = ListFindings()
    found = table(text, findings)
    rows = [
        {key: (cell.text, cell.line, cell.column) for key, cell in row.cells.items()} for row in found.rows
    ]
    return rows, [finding.text for finding in findings.all()]


def test_cells_have_line_and_column() -> None:
    rows, _ = read('Name;Adresse\n\n"a;b";  7\nc;8\n')
    assert rows == [
        {"name": ("a;b", 3, 1), "address": ("7", 3, 7)},
        {"name": ("c", 4, 1), "address": ("8", 4, 3)},
    ]


def test_a_cell_may_have_several_lines() -> None:
    rows, _ = read('name,comment,address\na,"one\ntwo",7\nb,,8\n')
    assert rows[0]["comment"] == ("one two", 2, 3)
    assert rows[1]["name"] == ("b", 4, 1)


def test_a_quotation_mark_that_is_not_closed_swallows_no_rows() -> None:
    rows, findings = read('name,comment,address\na,"one,7\nb,two,8\n')
    assert rows[0]["comment"][0] == "one,7 b,two,8"
    assert findings == ["a quotation mark is not closed: all that follows would be this cell"]


def test_rows_between_two_quotation_marks_are_a_doubt() -> None:
    _, findings = read('name,address,comment\na,7,"one\nb,8,"two"\nc,9,\n')
    assert findings == ["a text in quotation marks goes on in the next line"]


def test_titles_before_the_head_and_empty_lines_are_passed_over() -> None:
    rows, findings = read("Press 3\n\n;;\nName;Adresse\n;;\na;1\n")
    assert len(rows) == 1
    assert findings == []


def test_a_huge_cell_is_refused() -> None:
    _, findings = read("name,address\n" + "x" * 3000 + ",1\n")
    assert findings == ["more than 2000 characters in one cell"]


def test_what_is_not_utf8_is_said() -> None:
    findings = ListFindings()
    assert decoded("Größe".encode("cp1252"), findings) == "Größe"
    assert [finding.text for finding in findings.all()] == ["the file is not UTF-8; read as Windows-1252"]


def test_a_column_called_bereich_has_what_its_cells_look_like() -> None:
    """German lists have areas or limits there."""
    assert read("Name;Adresse;Bereich\na;1;Halteregister\nb;2;\n")[0][0]["area"][0] == "Halteregister"
    rows, findings = read("Name;Adresse;Registerart;Bereich\na;1;holding;\nb;2;coil;0..1\n")
    assert [row.get("limits", ("", 0, 0))[0] for row in rows] == ["", "0..1"]
    assert [row["area"][0] for row in rows] == ["holding", "coil"]
    assert findings == []


def test_a_column_with_areas_and_limits_is_one_of_areas() -> None:
    """What cannot be read there is found when the rows are read."""
    rows, _ = read("Name;Adresse;Bereich\na;1;holding\nb;2;0..100\n")
    assert [row["area"][0] for row in rows] == ["holding", "0..100"]
