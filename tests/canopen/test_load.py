"""The arithmetic of bus load; what links make of it is in tests/links."""

from __future__ import annotations

import pytest

from gatewayd.canopen.load import Share, frame_bits, load


@pytest.mark.parametrize("length, bits", [(0, 55), (1, 65), (8, 135)])
def test_longest_frames(length: int, bits: int) -> None:
    assert frame_bits(length) == bits


def test_shares_add_up() -> None:
    assert load([Share("a", 100, 10.0), Share("b", 50, 20.0)], 10_000) == 0.2
