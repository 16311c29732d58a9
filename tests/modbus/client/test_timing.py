from __future__ import annotations

import pytest

from gatewayd.modbus.client.timing import RtuTiming


@pytest.mark.parametrize(
    "baudrate, gap",
    [(9600, 3.5 * 11 / 9600), (19200, 3.5 * 11 / 19200), (19201, 0.00175), (115200, 0.00175)],
)
def test_gap_between_frames(baudrate: int, gap: float) -> None:
    """Serial Line V1.02, 2.5.1.1."""
    assert RtuTiming.of(baudrate).gap == pytest.approx(gap)


def test_frames_take_their_time() -> None:
    assert RtuTiming.of(9600, 10).transmission(96) == pytest.approx(0.1)


def test_serial_server_keeps_the_gaps_itself() -> None:
    timing = RtuTiming.behind_server(0.2)
    assert (timing.gap, timing.transmission(100), timing.turnaround) == (0, 0, 0.2)
