from __future__ import annotations

from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.field_choice import USUAL, hint, named, of_file
from gatewayd.rtde.fields import OUTPUTS, Series
from gatewayd.rtde.types import DataType


def test_what_is_usual_every_controller_has_from_the_start() -> None:
    assert all(OUTPUTS[name].first_version(series) is None for name in USUAL for series in Series)


def test_names_come_with_commas_blanks_and_repeatedly() -> None:
    assert named(["actual_q,actual_qd", "timestamp actual_q", ""]) == ("actual_q", "actual_qd", "timestamp")
    assert named(["dexterity"]) == ("dexterity",), "a controller may be newer than the catalogue"


def test_a_slip_of_the_pen_is_said() -> None:
    with pytest.raises(click.UsageError, match="it is written actual_TCP_pose"):
        named(["actual_tcp_pose"])
    assert hint("actual_qq").startswith("; did you mean actual_q")
    assert hint("actual_q") == hint("input_int_register_0") == hint("entirely_else") == ""


@given(st.text())
def test_whatever_is_typed_is_a_name_or_refused(text: str) -> None:
    try:
        found = named([text])
    except click.UsageError:
        return
    assert all(name.isidentifier() and name.isascii() for name in found)


def test_a_file_has_names_and_types(tmp_path: Path) -> None:
    path = tmp_path / "recipe.xml"
    path.write_text(
        '<rtde_config><recipe key="x"><field name="actual_q" type="VECTOR6D"/></recipe></rtde_config>'
    )
    assert of_file(path, None) == {"actual_q": DataType.VECTOR6D}
    with pytest.raises(click.UsageError, match=r"recipe\.xml"):
        of_file(path, "y")
    text = tmp_path / "recipe.txt"
    text.write_text("actual_q\ntimestamp\n")
    assert of_file(text, None) == {"actual_q": None, "timestamp": None}
    path.write_bytes(b"\xff\x00")
    with pytest.raises(click.UsageError):
        of_file(path, None)
