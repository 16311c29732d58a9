"""Data sheets beside a mapping, and those that are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.links.devices.canopen import sheets
from gatewayd.links.devices.canopen.sheets import sheet_of
from gatewayd.mapping.document import Document
from gatewayd.mapping.source import parse
from tests.links.devices.canopen.cells import SHEET


def document(directory: Path) -> Document:
    """A mapping file in this directory."""
    return Document(parse(b"gatewayd: 1\n", str(directory / "press.yaml")), "press")


def test_read_once_for_each_content(tmp_path: Path) -> None:
    (tmp_path / "a.eds").write_bytes(SHEET.read_bytes())
    first = sheet_of(document(tmp_path), "a.eds", 5)
    assert first.sheet is not None
    assert sheet_of(document(tmp_path), "a.eds", 5).sheet is first.sheet
    assert sheet_of(document(tmp_path), "a.eds", 6).sheet is not first.sheet
    (tmp_path / "a.eds").write_bytes(SHEET.read_bytes() + b"\n")
    assert sheet_of(document(tmp_path), "a.eds", 5).sheet is not first.sheet


@pytest.mark.parametrize(
    "name, problem",
    [
        ("nothing.eds", "No such file or directory"),
        (".", "Is a directory"),
        ("a\0b", "embedded null byte"),
        ("bad.eds", "this is no data sheet that can be read"),
        ("long.eds", "it has more than 100 bytes"),
    ],
)
def test_what_cannot_be_read(
    name: str, problem: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sheets, "MAX_SHEET", 100)
    (tmp_path / "bad.eds").write_text("hello")
    (tmp_path / "long.eds").write_text("x" * 101)
    found = sheet_of(document(tmp_path), name, 5)
    assert found.sheet is None
    assert problem in found.problem
