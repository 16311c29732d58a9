"""Whether the robot program ran when a package was recorded."""

from __future__ import annotations

import pytest

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import program_runs


def recipe(*names: str) -> Recipe:
    return Recipe(names, [OUTPUTS[name].type for name in names])


@pytest.mark.parametrize("state, runs", [(0, False), (1, False), (2, True), (4, False)])
def test_the_state_of_the_program_tells_it(state: int, runs: bool) -> None:
    test = program_runs(recipe("timestamp", "robot_status_bits", "runtime_state"))
    assert test is not None
    assert test((0.0, 0xF, state)) is runs


@pytest.mark.parametrize("bits, runs", [(0, False), (1, False), (2, True), (3, True)])
def test_the_robots_status_tells_it_too(bits: int, runs: bool) -> None:
    test = program_runs(recipe("robot_status_bits"))
    assert test is not None
    assert test((bits,)) is runs


def test_without_either_it_is_not_known() -> None:
    assert program_runs(recipe("timestamp")) is None
