"""The changelog of the Debian package is CHANGELOG.md."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.packaging.programs import PACKAGING, ROOT, program

changelog = program("changelog")
TEXT = """\
# Changelog

## [Unreleased]

### Fixed

- One thing that is told in a line that is so long that it does not fit into the eighty columns of a changelog.
- Another
  thing.

## [0.1.0] - 2026-02-03

### Added

- All.
"""


def test_an_entry_for_each_release() -> None:
    new, old = changelog.entries(TEXT, "0.2.0", 0)
    assert new.splitlines()[:3] == ["gatewayd (0.2.0) unstable; urgency=medium", "", "  [ Fixed ]"]
    assert "  * Another thing." in new.splitlines()
    assert max(map(len, new.splitlines())) <= 80
    assert old.startswith("gatewayd (0.1.0) unstable")
    assert old.rstrip().endswith("Tue, 03 Feb 2026 00:00:00 -0000")


def test_a_release_without_changes_since_has_no_entry_of_its_own() -> None:
    (only,) = changelog.entries(re.sub(r"(?s)### Fixed.*(?=## \[0)", "", TEXT), "0.1.0", 0)
    assert "[ Added ]" in only


@pytest.mark.skipif(shutil.which("dpkg-parsechangelog") is None, reason="dpkg-dev is missing")
def test_dpkg_understands_it(tmp_path: Path) -> None:
    written = subprocess.run(
        [sys.executable, PACKAGING / "changelog.py", "9.9"], capture_output=True, text=True, check=True
    ).stdout
    (tmp_path / "changelog").write_text(written)
    done = subprocess.run(
        ["dpkg-parsechangelog", "-l", tmp_path / "changelog", "-S", "Version"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout.strip(), done.stderr) == ("9.9", "")
    points = len(re.findall(r"^- ", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE))
    assert written.count("\n  * ") == points
