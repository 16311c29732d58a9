from __future__ import annotations

import csv
import io

from gatewayd.cli.rtde.field_rows import (
    FieldRow,
    answered_rows,
    as_csv,
    catalogue_rows,
    folded,
    is_there,
    remark,
)
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Series, SoftwareVersion


def test_the_catalogue_is_shown_whole_or_for_a_software() -> None:
    assert len(catalogue_rows(None, None)) == len(INPUTS) + len(OUTPUTS)
    names = {row.name for row in catalogue_rows(Series.E, SoftwareVersion(5, 8))}
    assert "actual_q" in names
    assert "ft_raw_wrench" not in names
    assert "ft_raw_wrench" in {row.name for row in catalogue_rows(Series.E, SoftwareVersion(5, 9))}


def test_first_versions_are_named_by_series() -> None:
    rows = {(row.name, row.direction): row for row in catalogue_rows(None, None)}
    assert rows["tcp_offset", "output"].since == "cb3 3.12.0, e 5.5.1"
    assert rows["ft_raw_wrench", "output"].since == "cb3 never, e 5.9.0"
    assert rows["actual_q", "output"].since == ""
    assert rows["actual_moment", "output"].since == "no known version"


def test_answers_stand_beside_the_catalogue() -> None:
    new, q, register = answered_rows(
        {"dexterity": "DOUBLE", "actual_q": "NOT_FOUND"}, {"input_int_register_0": "IN_USE"}
    )
    assert (new.type, new.catalogue, new.comment) == ("DOUBLE", "", "not in the catalogue")
    assert (q.type, q.catalogue) == ("NOT_FOUND", "VECTOR6D")
    assert (register.direction, register.type) == ("input", "IN_USE")
    assert remark(register).startswith("in use, probably by the robot's PROFINET or EtherNet/IP adapter")
    assert (q.holder, remark(q)) == ("", "joint positions")
    assert [is_there(row) for row in (new, q, register)] == [True, False, True]


def test_neighbours_that_say_the_same_are_one_line() -> None:
    inputs = {f"input_int_register_{number}": "INT32" for number in range(4)} | {
        "input_int_register_4": "IN_USE",
        "input_int_register_6": "IN_USE",
    }
    names = [row.name for row in folded(answered_rows({"actual_q": "VECTOR6D"}, inputs))]
    assert names == [
        "actual_q", "input_int_register_0..3", "input_int_register_4", "input_int_register_6",
    ]  # fmt: skip


def test_csv_has_every_row_and_hides_nothing_that_steers_a_terminal() -> None:
    row = FieldRow("odd\x1b[2J,name", "output", "DOUBLE", "", "m", "", "")
    (read,) = csv.DictReader(io.StringIO(as_csv([row])))
    assert read["name"] == "odd\\x1b[2J,name"
    assert read["unit"] == "m"
