"""The birth/death sequence number outlives a restart."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.links.mqtt.bd_seq import bd_seq_file, read_bd_seq, write_bd_seq


def test_it_is_kept(tmp_path: Path) -> None:
    file = bd_seq_file(tmp_path, "plant", "hall-2")
    assert read_bd_seq(file) == 0
    write_bd_seq(file, 255)
    assert read_bd_seq(file) == 255
    assert [each.name for each in tmp_path.iterdir()] == ["sparkplug.plant.hall-2.bdseq"]


def test_names_that_are_no_files(tmp_path: Path) -> None:
    assert bd_seq_file(tmp_path, "..", "a b.c").name == "sparkplug._2e__2e_.a_20_b_2e_c.bdseq"


@pytest.mark.parametrize("content", [b"", b"-1", b"256", b"9" * 50, b"\xff", b"x"])
def test_anything_else_counts_as_none(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "kept"
    file.write_bytes(content)
    assert read_bd_seq(file) == 0
