"""What a command line means by the names on it."""

from __future__ import annotations

from pathlib import Path

from gatewayd.mapping.files import files_of


def test_a_directory_stands_for_its_mapping_files_as_a_shell_would_read_it(tmp_path: Path) -> None:
    for name in (
        "b.yaml",
        "a.yml",
        "C.YAML",
        ".a.yaml",
        "._b.yaml",
        ".#b.yaml",
        "b.yaml~",
        "b.yaml.bak",
        "x.txt",
    ):
        (tmp_path / name).touch()
    assert [file.name for file in files_of(tmp_path)] == ["C.YAML", "a.yml", "b.yaml"]
    assert files_of(tmp_path / "gone.yaml") == [tmp_path / "gone.yaml"]
