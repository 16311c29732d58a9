from __future__ import annotations

import pytest

from gatewayd.core.program import STATES, is_running
from gatewayd.rtde.enums import PROGRAM_ADVANCES, PROGRAM_IDLE, ProgramState


@pytest.mark.parametrize(
    "state", [ProgramState.RUNNING, ProgramState.PAUSING, ProgramState.PAUSED, ProgramState.RESUMING]
)
def test_a_program_that_pauses_still_owns_what_it_wrote(state: ProgramState) -> None:
    assert is_running(state)


@pytest.mark.parametrize("state", [ProgramState.STOPPING, ProgramState.STOPPED, ProgramState.RETRACTING])
def test_a_program_that_stops_owns_nothing(state: ProgramState) -> None:
    assert not is_running(state)


@pytest.mark.parametrize("state", [None, -1, 99])
def test_what_nobody_knows_is_not_running(state: int | None) -> None:
    assert not is_running(state)


def test_the_states_are_those_of_rtde() -> None:
    assert set(STATES) == set(ProgramState)


def test_a_program_that_advances_runs_and_an_idle_one_does_not() -> None:
    running = {state for state in STATES if is_running(state)}
    assert running > PROGRAM_ADVANCES
    assert running.isdisjoint(PROGRAM_IDLE)
