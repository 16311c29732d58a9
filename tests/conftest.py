"""What all tests share: how hypothesis behaves, and a plant of real processes.

The ordinary profile makes the same examples every time, so a red run can be repeated; `--hypothesis-profile=thorough`
looks for new ones, and for longer.
"""

from __future__ import annotations

from collections.abc import Iterator
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


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    """Its processes end with the test."""
    built = Plant(tmp_path)
    try:
        yield built
    finally:
        built.stop()
