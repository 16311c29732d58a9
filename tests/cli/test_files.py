"""Mapping files by path or from standard input."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.cli.files import load_file, mapping_files, name_of, read_named, reason_of
from gatewayd.mapping.compiled import Unreadable


def test_standard_input_has_a_name() -> None:
    assert (name_of("-"), name_of("a.yaml")) == ("stdin", "a.yaml")


def test_a_file_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The operating system says why."""
    assert load_file(str(tmp_path / "no.yaml")) is None
    assert capsys.readouterr().err.endswith("no.yaml: cannot be read: No such file or directory\n")
    assert reason_of(ValueError("embedded null byte")) == "embedded null byte"


def test_a_file_with_errors_is_loaded_and_they_are_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.yaml").write_text("gatewayd: 2\n")
    loaded = load_file(str(tmp_path / "a.yaml"))
    assert loaded is not None
    assert loaded.plan is None
    assert "GW107" in capsys.readouterr().err


def test_a_directory_stands_for_its_mapping_files_and_each_counts_once(tmp_path: Path) -> None:
    for name in ("b.yml", "a.yaml", ".hidden.yaml", "notes.txt"):
        (tmp_path / name).touch()
    first, second = str(tmp_path / "a.yaml"), str(tmp_path / "b.yml")
    assert mapping_files([second, str(tmp_path), "-", "-"]) == [second, first, "-"]


def test_what_cannot_be_read_has_its_reason(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_bytes(b"cell: a")
    (tmp_path / "empty").mkdir()
    assert read_named(str(tmp_path / "a.yaml")) == (str(tmp_path / "a.yaml"), b"cell: a")
    for missing, reason in (("no.yaml", "No such file"), ("empty", "no mapping file (*.yaml, *.yml)")):
        name, content = read_named(str(tmp_path / missing))
        assert isinstance(content, Unreadable)
        assert content.name == name
        assert content.reason.startswith(reason)
