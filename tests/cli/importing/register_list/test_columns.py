"""Which column means what."""

from __future__ import annotations

import pytest

from gatewayd.cli.importing.register_list.columns import DETAIL, MEANINGS, column_of
from gatewayd.report.table import columns


@pytest.mark.parametrize(
    "head, column",
    [
        ("Name", "name"), ("Tag Name", "name"), ("Bezeichnung", "name"), ("Register", "address"),
        ("Modbus-Adresse (dez)", "address"), ("Startadresse", "address"), ("Data type", "type"),
        ("Datentyp", "type"), ("R/W", "access"), ("Zugriff", "access"), ("Skalierung", "scale"),
        ("Auflösung", "scale"), ("Einheit [SI]", "unit"), ("Länge", "words"), ("Wort-Reihenfolge", "order"),
        ("Function code", "function"), ("Bemerkung", "comment"), ("Farbe", ""), ("", ""),
    ],
)  # fmt: skip
def test_english_and_german_names(head: str, column: str) -> None:
    assert column_of(head) == column


def test_every_column_of_show_is_recognised() -> None:
    for head in columns():
        assert column_of(head) in {*MEANINGS, DETAIL}, head
