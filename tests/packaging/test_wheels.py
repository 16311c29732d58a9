"""Which wheels the package carries. That they are to be had for each architecture and Python: `make deb-check`."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.packaging.programs import ROOT, program

wheels = program("wheels")
LOCK = (ROOT / "requirements.lock").read_text()


def names(lock: str) -> set[str]:
    return set(re.findall(r"^([\w-]+)==", lock, re.MULTILINE))


def test_all_that_is_locked_but_what_only_builds() -> None:
    assert names(LOCK) - names(wheels.requirements(LOCK)) == {"flit-core"}


def test_each_has_its_hashes() -> None:
    for entry in re.split(r"\n(?=\w)", wheels.requirements(LOCK))[1:]:
        assert "--hash=sha256:" in entry, entry
        assert "flit" not in entry


def test_the_versions_are_those_of_the_classifiers() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = {line.rpartition(" ")[2] for line in project["classifiers"] if ":: 3." in line}
    assert named == set(wheels.VERSIONS)


def test_only_locked_wheels_for_the_machine_that_will_run_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands: list[list[str]] = []

    def run(command: list[Any], **_: object) -> None:
        commands.append([str(word) for word in command])

    monkeypatch.setattr(subprocess, "run", run)
    (tmp_path / "3.13").mkdir()
    wheels.download(tmp_path, tmp_path / "lock", "armhf", "3.13")
    (command,) = commands
    assert {"--only-binary=:all:", "--no-deps", "--require-hashes", "--python-version=3.13"} <= set(command)
    platforms = {word.partition("=")[2] for word in command if word.startswith("--platform")}
    assert {"manylinux_2_17_armv7l", "manylinux_2_31_armv7l"} <= platforms
    assert "manylinux_2_37_armv7l" not in platforms, "newer than Debian 12"


def test_the_oldest_glibc_that_all_of_them_take() -> None:
    assert wheels.glibc(["a-1-py3-none-any.whl"]) == 17
    both = "b-1-cp311-cp311-manylinux1_x86_64.manylinux_2_28_x86_64.manylinux_2_5_x86_64.whl"
    assert wheels.glibc([both, "c-1-cp311-cp311-manylinux_2_28_x86_64.whl"]) == 28
