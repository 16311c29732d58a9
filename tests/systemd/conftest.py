"""The Debian package of this tree, built once for all tests and all processes of a run."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SYSTEM_PYTHON = Path("/usr/bin/python3")


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory that all processes of this run share."""
    base = tmp_path_factory.getbasetemp()
    found = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / "systemd"
    found.mkdir(exist_ok=True)
    return found


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """One process at a time."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="session")
def python_with_pip() -> Path:
    """An interpreter whose pip can install into another environment."""
    for candidate in (Path(sys.executable), Path(sys.base_prefix) / "bin/python3"):
        if (
            subprocess.run([candidate, "-m", "pip", "--version"], capture_output=True, check=False).returncode
            == 0
        ):
            return candidate
    pytest.skip("no pip at hand to build the package with")


@pytest.fixture(scope="session")
def package(shared: Path, python_with_pip: Path) -> Path:
    """The .deb."""
    if shutil.which("dpkg-deb") is None:
        pytest.skip("dpkg-deb is missing: this is no Debian")
    with locked(shared / "package.lock"):
        found = list(shared.glob("gatewayd_*.deb"))
        if not found:
            done = subprocess.run(
                [ROOT / "packaging/deb", shared, python_with_pip],
                capture_output=True,
                text=True,
                check=False,
                env={**os.environ, "COMPRESSION": "gzip"},
            )
            assert done.returncode == 0, done.stderr
            found = [Path(done.stdout.strip())]
    return found[0]
