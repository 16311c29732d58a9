"""The words of the bus."""

from __future__ import annotations

from gatewayd.canopen.bus import BusState


def test_states_are_ordered_by_usefulness() -> None:
    assert [state.name for state in sorted(BusState)] == [
        "ABSENT",
        "DOWN",
        "BUS_OFF",
        "PASSIVE",
        "WARNING",
        "ACTIVE",
    ]


def test_frames_go_through_from_passive_on() -> None:
    assert [state for state in BusState if state.carries] == [
        BusState.PASSIVE,
        BusState.WARNING,
        BusState.ACTIVE,
    ]
