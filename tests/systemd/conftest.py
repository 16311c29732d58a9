"""The Debian package of this tree and a machine that it is tried on: both made once for all processes of a run.

The machine boots as soon as the tests are collected, and goes on beside the others.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.systemd import machine

HERE = Path(__file__).parent
MACHINE = pytest.StashKey["subprocess.Popen[bytes]"]()


def directory_of_run(config: pytest.Config) -> Path:
    """A directory that all processes of this run share."""
    base: Path = getattr(config, "_tmp_path_factory").getbasetemp()  # noqa: B009 - fixtures do not exist yet
    found = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / "systemd"
    found.mkdir(exist_ok=True)
    return found


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put what the machine is asked for last, and have it made."""
    ours = [item for item in items if item.path == HERE / "test_boot.py"]
    if not ours or machine.missing() or config.option.collectonly:
        return
    items[:] = [item for item in items if item not in set(ours)] + ours
    shared = directory_of_run(config)
    if any(character.isspace() for character in str(shared)) or not machine.can_build():
        return
    try:
        (shared / "begun").touch(exist_ok=False)
    except FileExistsError:
        return
    with (shared / "machine.log").open("wb") as log:
        config.stash[MACHINE] = subprocess.Popen(
            [sys.executable, "-m", "tests.systemd.machine", shared],
            cwd=machine.ROOT,
            stdout=log,
            stderr=subprocess.STDOUT,
        )


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Others may still wait for the machine that this process has made."""
    running = session.config.stash.get(MACHINE, None)
    if running is not None:
        if exitstatus == pytest.ExitCode.INTERRUPTED or session.shouldfail or session.shouldstop:
            running.terminate()
        running.wait()


@pytest.fixture(scope="session")
def shared(request: pytest.FixtureRequest) -> Path:
    """A directory that all processes of this run share."""
    return directory_of_run(request.config)


@pytest.fixture(scope="session")
def package(shared: Path) -> Path:
    """The .deb."""
    if not machine.can_build():
        pytest.skip("no pip, or no flit_core, at hand to build the package with")
    if not machine.has_dpkg_deb():
        pytest.skip("dpkg-deb is missing: this is no Debian")
    return machine.package(shared)
