"""The text of data sheets; what it means for objects is in test_data_sheet.py."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.manager.sheet_text import decoded, number, repaired


@pytest.mark.parametrize(
    "date, time, modified",
    [
        ("01-01-1984", "12:00AM", (0, 0)),
        ("01-02-1984", "01:00PM", (1, 46_800_000)),
        ("01-02-1984", "13:00", (1, 46_800_000)),
        ("01-02-1984", "", (1, 0)),
        ("01-02-1980", "", None),
        ("2024-01-02", "", None),
        ("", "", None),
    ],
)
def test_date_of_the_file(date: str, time: str, modified: tuple[int, int] | None) -> None:
    assert repaired(f"[FileInfo]\nModificationDate={date}\nModificationTime={time}\n").modified == modified


def test_what_is_left_out_and_what_is_put_right() -> None:
    read = repaired(
        "[Comments]\nLine1=x\n[2000]\nPDOMapping=\nParameterName=\nDataType=5 ; five\nCompactSubObj=4\n"
    )
    assert read.text == "[2000]\nParameterName=2000\nDataType=5 ; five\nCompactSubObj=4\n"
    assert read.compact == {0x2000: 4}


def test_encodings() -> None:
    assert decoded("\ufeffä".encode()) == "ä"
    assert decoded("ä".encode("cp1252")) == "ä"
    assert decoded(b"\x81") == "\ufffd"


@given(st.text(max_size=20))
def test_any_text_is_a_number_or_none(text: str) -> None:
    assert isinstance(number(text, 5), int | None)
