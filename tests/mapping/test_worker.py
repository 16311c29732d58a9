"""The process that compiles for another one: whatever is named, it answers."""

from __future__ import annotations

import io
import os
import pickle
import sys
from pathlib import Path

import pytest

from gatewayd.mapping.compiled import Compiled
from gatewayd.mapping.loader import load
from gatewayd.mapping.worker import compile_files, main, names_from

SMALL = Path(__file__).parents[2] / "mappings" / "small-cell.yaml"


def test_files_come_in_the_order_in_which_they_were_named(tmp_path: Path) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_bytes(b"\xff")
    missing = str(tmp_path / "missing.yaml")
    found = compile_files([str(broken), missing, str(SMALL), "nul\0.yaml"])
    assert [one.name for one in found.files] == [str(broken), str(SMALL)]
    assert found.plans == (load(SMALL.read_bytes(), str(SMALL)).plan,)
    assert [one.name for one in found.unreadable] == [missing, "nul\0.yaml"]
    assert found.unreadable[0].reason == "No such file or directory"
    assert "null" in found.unreadable[1].reason


def test_the_answer_is_all_that_it_writes(monkeypatch: pytest.MonkeyPatch) -> None:
    out = io.TextIOWrapper(io.BytesIO())
    monkeypatch.setattr(sys, "stdout", out)
    main([str(SMALL)])
    answer = io.BytesIO(out.buffer.getvalue())
    found = pickle.load(answer)  # noqa: S301 - what `main` wrote
    assert isinstance(found, Compiled)
    assert len(found.plans) == 1
    assert answer.read() == b""


def test_names_are_those_that_were_said() -> None:
    names = ["a.yaml", "with space\n.yaml", "\udcff.yaml", "nul\0.yaml"]
    lines = b"".join(os.fsencode(name).hex().encode() + b"\n" for name in names)
    assert names_from(io.BytesIO(lines + b"\n")) == names
    assert names_from(io.BytesIO(b"\n")) == []


def test_nobody_waits_for_names_that_never_come() -> None:
    with pytest.raises(EOFError):
        names_from(io.BytesIO(b"61\n"))
