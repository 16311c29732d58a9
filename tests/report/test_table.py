"""The register table and its forms."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence

import pytest

import gatewayd.report.table as table_module
from gatewayd.links.registry import tables
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.loader import Loaded, load
from gatewayd.mapping.plan import Plan
from gatewayd.report.layout import Column
from gatewayd.report.table import (
    as_csv,
    as_json,
    as_markdown,
    by_line,
    columns,
    formula,
    limits,
    lost,
    policy,
    rows,
)

TEXT = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10}
modbus: {listen: '192.0.2.2:1502', unit: 3}
writers:
  plc: {modbus: 192.0.2.20, timeout: 1s}
  hmi: {modbus: 192.0.2.21, timeout: 1s}
groups:
  motion: {owner: [plc, hmi], lease: 2s}
variables:
  start: {robot: input_bit_register_33, modbus: [0.1, {coil: 33}], owner: plc}
  speed: {robot: input_double_register_0, modbus: {holding: 20, type: int16, scale: 0.1, offset: -5}, group: motion,
          limits: [0, 150], clamp: true, on_release: 10, unit: mm/s, comment: 'a | b, "c"'}
  call: {robot: input_int_register_0, modbus: {holding: 30, order: CDAB}, group: motion, on_release: hold}
  tcp: {robot: actual_TCP_pose, modbus: {input: 100, type: float32}, on_stale: exception}
"""


@pytest.fixture(scope="module")
def loaded() -> Loaded:
    return load(TEXT.encode(), "cell.yaml")


@pytest.fixture(scope="module")
def plan(loaded: Loaded) -> Plan:
    assert loaded.plan is not None
    return loaded.plan


def test_one_row_for_each_place(loaded: Loaded) -> None:
    """A variable at two places has two rows with one number."""
    table = rows(loaded.cell)
    assert [
        (row.number, row.name, row["area"], row["address"], row["bit"], row["notation"]) for row in table[:3]
    ] == [
        (1, "start", "holding", 0, 1, "400001.1"),
        (1, "start", "coil", 33, None, "000034"),
        (2, "speed", "holding", 20, None, "400021"),
    ]
    assert len(table) == 1 + 1 + 1 + 1 + 6


def test_a_row_holds_everything(loaded: Loaded) -> None:
    speed = rows(loaded.cell)[2]
    assert speed.direction == "input"
    assert speed["robot"] == "input_double_register_0"
    assert (speed["words"], speed["type"], speed["order"], speed["scale"], speed["offset"]) == (
        1,
        "int16",
        "",
        0.1,
        -5,
    )
    assert (speed.unit, speed.low, speed.high, speed.clamp) == ("mm/s", 0, 150, True)
    assert (speed.owner, speed.lease, speed.takeover, speed.group) == ("plc > hmi", 2, True, "motion")
    assert (speed.on_release, speed.on_stale) == ("10", "")


def test_outputs_have_no_owner(loaded: Loaded) -> None:
    last = rows(loaded.cell)[-1]
    assert (last.name, last["robot"], last["notation"]) == ("tcp[5]", "actual_TCP_pose[5]", "300111")
    assert (last.owner, last.lease, last.on_release, last.on_stale) == ("", None, "", "exception")


def test_lines_are_shortened_to_their_ends(loaded: Loaded) -> None:
    """One entry for a line and place, whatever it expands to."""
    assert [(first.name, last.name, last["address"]) for first, last in by_line(loaded.cell)] == [
        ("start", "start", 0),
        ("start", "start", 33),
        ("speed", "speed", 20),
        ("call", "call", 30),
        ("tcp[0]", "tcp[5]", 110),
    ]


def test_words_for_people(loaded: Loaded) -> None:
    speed = rows(loaded.cell)[2]
    assert formula(speed) == "raw * 0.1 - 5 mm/s"
    assert limits(speed) == "0..150 clamped"
    assert policy(speed) == "plc > hmi, 2s (motion)"


def test_csv_reads_back(loaded: Loaded) -> None:
    """Every column of every row survives, commas and quotes included."""
    table = rows(loaded.cell)
    read = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert tuple(read[0]) == columns()
    assert len(read) == len(table)
    assert (read[2]["comment"], read[2]["clamp"], read[2]["address"]) == ('a | b, "c"', "true", "20")
    assert read[0]["scale"] == ""


def test_json_is_complete(loaded: Loaded, plan: Plan) -> None:
    document = json.loads(as_json(plan, loaded.cell, rows(loaded.cell)))
    assert (document["version"], document["cell"]) == (1, "press-3")
    assert document["modbus"] == {"host": "192.0.2.2", "port": 1502, "unit": 3}
    assert int(document["fingerprint"], 16) == plan.cell.fingerprint
    assert set(document["variables"][0]) == set(columns())


def test_markdown_is_a_table(loaded: Loaded, plan: Plan) -> None:
    """Bars in a comment do not break it."""
    lines = as_markdown(plan, loaded.cell, rows(loaded.cell)).splitlines()
    table = [line for line in lines if line.startswith("|")]
    assert len(table) == 2 + 10
    assert {line.replace("\\|", "").count("|") for line in table} == {14}


def test_a_variable_without_a_place_has_a_row() -> None:
    text = TEXT.replace(
        "{robot: actual_TCP_pose, modbus: {input: 100, type: float32}, on_stale: exception}",
        "{robot: robot_mode}",
    )
    last = rows(load(text.encode(), "cell.yaml").cell)[-1]
    assert (last["robot"], last["area"], last["address"], last["notation"], last["words"]) == (
        "robot_mode",
        "",
        None,
        "",
        0,
    )


def test_new_keys_have_columns_and_words() -> None:
    """A whole group, and outputs that hang on the robot program."""
    text = TEXT.replace("{host: 192.0.2.10}", "{host: 192.0.2.10, valid: running}")
    text = text.replace("lease: 2s}", "lease: 2s, whole: true}") + (
        "  answer: {robot: output_int_register_0, modbus: 110, on_stale: hold}\n"
    )
    table = {row.name: row for row in rows(load(text.encode(), "cell.yaml").cell)}
    assert (table["call"].whole, table["start"].whole) == (True, False)
    assert policy(table["call"]) == "plc > hmi, 2s (motion, whole)"
    assert (lost(table["answer"]), lost(table["tcp[0]"]), lost(table["call"])) == (
        "hold, running",
        "exception",
        "hold",
    )


class Bell(LinkTables):
    """A kind that nobody knows."""

    key = "bell"
    columns = (Column("bell", empty=None),)

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """Every variable rings."""
        return {variable.index: [{"bell": variable.index * 10}] for variable in cell.variables}


def test_a_new_kind_has_its_column_in_every_form(
    monkeypatch: pytest.MonkeyPatch, loaded: Loaded, plan: Plan
) -> None:
    """After the known ones."""
    monkeypatch.setattr(table_module, "tables", lambda: (*tables(), Bell()))
    table = rows(loaded.cell)
    assert columns()[-1] == "bell"
    read = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert [row["bell"] for row in read[:3]] == ["0", "0", "10"]
    document = json.loads(as_json(plan, loaded.cell, table))
    assert (document["bell"], document["variables"][2]["bell"]) == (None, 10)
    page = as_markdown(plan, loaded.cell, table).splitlines()
    assert next(line for line in page if line.startswith("| no.")).endswith("| comment | bell |")
    assert next(line for line in page if line.startswith("| 2 ")).endswith("| 10 |")
