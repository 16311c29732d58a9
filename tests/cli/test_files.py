"""Mapping files by path or from standard input."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.cli.files import load_file, name_of, reason_of


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
