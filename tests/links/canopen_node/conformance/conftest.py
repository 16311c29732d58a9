"""The device under test: on a wire where time is exact, and in its own link on a bus."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.links.canopen_node.conformance.bench import LinkDevice, Tester, WireDevice, powered


@pytest.fixture(params=[WireDevice, LinkDevice], ids=["wire", "link"])
def dut(request: pytest.FixtureRequest) -> Iterator[Tester]:
    """Twice: on the wire, and in a link."""
    yield from powered(request.param())


@pytest.fixture
def exact() -> Iterator[Tester]:
    """On the wire alone, for what is a matter of milliseconds or of minutes."""
    yield from powered(WireDevice())


@pytest.fixture
def linked() -> Iterator[Tester]:
    """In a link alone."""
    yield from powered(LinkDevice())
