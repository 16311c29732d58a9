"""What all tests share: how hypothesis behaves, a plant of real processes, which tests are slow and when they run.

The ordinary profile makes the same examples every time, so a red run can be repeated; `--hypothesis-profile=thorough`
looks for new ones, and for longer.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.e2e.plant import Plant

# A shared machine may stop a test for longer than any deadline.
settings.register_profile(
    "ordinary", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("thorough", settings.get_profile("ordinary"), derandomize=False, max_examples=5000)
settings.load_profile("ordinary")

HERE = Path(__file__).parent
SOAK = HERE / "soak"
SLOW = (
    "cli/test_demo.py",
    "cli/test_run.py",
    "core/test_cell_properties.py",
    "demo/test_scene.py",
    "demo/test_snapshot.py",
    "docs",
    "e2e",
    "fleet",
    "kernel",
    "links/new_kind",
    "mapping/test_check_fuzz.py",
    "service/test_reload_keys.py",
    "service/test_signals.py",
    "soak",
    "systemd",
    "test_demo.py",
    "web/test_page.py",
)
"""Files and directories whose tests are all slow; elsewhere a test says so itself."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Two for each processor: two thirds of the time are spent waiting for something real to happen."""
    return 2 * len(os.sched_getaffinity(0))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow, and put it last: the machines that boot meanwhile leave it more of the processors then."""
    for item in items:
        if _is_slow(item.path):
            item.add_marker(pytest.mark.slow)
    items.sort(key=_place)


def pytest_collection_finish() -> None:
    """Let no collection of garbage look at thousands of tests again: it took a third of the time."""
    gc.collect()
    gc.freeze()


@cache
def _is_slow(path: Path) -> bool:
    return any(path.is_relative_to(HERE / name) for name in SLOW)


def _place(item: pytest.Item) -> int:
    """The soak is the longest of all: it begins before the other slow ones."""
    if item.get_closest_marker("slow") is None:
        return 0
    return 1 if item.path.is_relative_to(SOAK) else 2


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    """Its processes end with the test."""
    yield from _plant(tmp_path)


@pytest.fixture(scope="module")
def lasting_plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    """For what the tests of a module share; whatever they do to it, the next test has to find it well."""
    yield from _plant(tmp_path_factory.mktemp("plant"))


def _plant(directory: Path) -> Iterator[Plant]:
    built = Plant(directory)
    try:
        yield built
    finally:
        built.stop()
