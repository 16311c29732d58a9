"""What the tests of Sparkplug have in common."""

from __future__ import annotations

import pytest


@pytest.fixture
def tck_id(request: pytest.FixtureRequest) -> str:
    """The statement of the specification that a case shows (`conformance.cases.tck`)."""
    name: str = request.param
    return name
