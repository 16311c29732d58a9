"""A tree is measured only if its interpreter runs its own gatewayd."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.benchmarks.trees import HERE, ROOT, Job, Tree, before


def test_this_tree_runs_its_own() -> None:
    HERE.check()


def test_an_interpreter_with_another_tree_s_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=f"has not gatewayd of {tmp_path} but {ROOT}"):
        Tree("before", tmp_path, sys.executable).check()


def test_the_other_tree_has_an_interpreter_of_its_own(tmp_path: Path) -> None:
    other = before(tmp_path)
    assert other.gatewayd("--help") == [str(tmp_path / ".venv/bin/python"), "-P", "-m", "gatewayd", "--help"]
    with pytest.raises(FileNotFoundError):
        other.check()
    assert Job(1.0, (HERE, other)).names == ("gatewayd", "before")
