"""The PDO table and the load for people and programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.links.canopen_node.pdo_table import (
    as_document,
    by_sdo_only,
    load_by_bit_rate,
    pdo_rows,
    transmission_words,
)
from gatewayd.links.canopen_node.tables import TABLES
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.loader import load
from gatewayd.report.table import rows

MAPPINGS = Path(__file__).parents[3] / "mappings"


@pytest.fixture(scope="module")
def cell() -> ExpandedCell:
    return load((MAPPINGS / "two-buses.yaml").read_bytes(), "two-buses.yaml").cell


def test_rows(cell: ExpandedCell) -> None:
    table = pdo_rows(cell)
    assert [
        (row.pdo, row.cob_id, row.predefined, transmission_words(row.transmission), row.event)
        for row in table
    ] == [
        ("RPDO 1 (command)", "0x214", True, "sync (1)", 0.1),
        ("RPDO 2", "0x314", True, "sync (1)", 0.1),
        ("TPDO 1", "0x194", True, "sync (1)", None),
        ("TPDO 2", "0x294", True, "sync (1)", None),
        ("TPDO 3 (forces)", "0x1C0", False, "every 5 SYNCs (5)", None),
    ]
    assert [(run.name, run.bit, run.bits, run.object, run.type) for run in table[0].runs] == [
        ("recipe", 0, 16, "2070h:01", "UNSIGNED16"),
        ("line_stop", 16, 1, "2000h:01", "BOOLEAN"),
        ("feed_ready", 17, 1, "2000h:02", "BOOLEAN"),
    ]


def test_neighbours_of_a_family_are_one_run() -> None:
    cell = load((MAPPINGS / "canopen-only.yaml").read_bytes(), "canopen-only.yaml").cell
    (run,) = pdo_rows(cell)[0].runs
    assert (run.name, run.object, run.bits) == ("in_bits[0..63]", "2000h:01-40", 64)


def test_what_no_pdo_carries(cell: ExpandedCell) -> None:
    assert by_sdo_only(cell) == ("part_number 2010h:01",)


def test_load_falls_with_the_bit_rate(cell: ExpandedCell) -> None:
    shares = load_by_bit_rate(cell)
    assert shares[10_000] == pytest.approx(100 * shares[1_000_000])


def test_without_a_node_there_is_nothing() -> None:
    cell = load((MAPPINGS / "full-image.yaml").read_bytes(), "full-image.yaml").cell
    assert (TABLES.rows(cell), TABLES.page_table(cell)) == ({}, None)


def test_document_has_every_bit(cell: ExpandedCell) -> None:
    document = as_document(cell)
    assert (document["node"], document["bitrate"]) == (20, 500_000)
    assert document["pdos"][0]["variables"][2] == {
        "name": "feed_ready",
        "bit": 17,
        "bits": 1,
        "object": "2000h:02",
        "type": "BOOLEAN",
    }


def test_the_register_table_names_object_and_pdo(cell: ExpandedCell) -> None:
    by_name = {row.name: row for row in rows(cell)}
    torque = by_name["torque"]
    assert (torque["object"], torque["can_type"], torque["pdo"], torque["cob_id"], torque["pdo_bit"]) == (
        "2430h:02",
        "REAL32",
        "TPDO 3 (forces)",
        "0x1C0",
        32,
    )
    part = by_name["part_number"]
    assert (part["object"], part["pdo"], part["cob_id"], part["pdo_bit"]) == ("2010h:01", "", "", None)


@pytest.mark.parametrize(
    "number, words",
    [
        (0, "sync, on change (0)"),
        (1, "sync (1)"),
        (7, "every 7 SYNCs (7)"),
        (254, "event (254)"),
        (255, "event (255)"),
    ],
)
def test_transmission_types_in_words(number: int, words: str) -> None:
    assert transmission_words(number) == words


def test_status_words_are_rows_and_parts_of_the_document() -> None:
    text = """\
gatewayd: 1
cell: c
robot: {host: r}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  pdos: {forces: {status: [flags, quality of force], variables: force}}
variables: {force: {robot: output_double_register_0, canopen: {type: REAL32}}}
"""
    cell = load(text.encode(), "c.yaml").cell
    (row,) = pdo_rows(cell)
    assert [(run.name, run.bit, run.bits, run.object, run.type) for run in (*row.status, *row.runs)] == [
        ("flags", 0, 16, "5F00h:02", "UNSIGNED16"),
        ("quality of force", 16, 16, "5F40h:01", "UNSIGNED16"),
        ("force", 32, 32, "2430h:01", "REAL32"),
    ]
    document = as_document(cell)
    (pdo,) = document["pdos"]
    assert list(pdo["status"]) == [
        {"name": "flags", "bit": 0, "bits": 16, "object": "5F00h:02", "type": "UNSIGNED16"},
        {"name": "quality of force", "bit": 16, "bits": 16, "object": "5F40h:01", "type": "UNSIGNED16"},
    ]
    assert [one["name"] for one in pdo["variables"]] == ["force"]
