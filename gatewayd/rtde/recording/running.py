"""Whether the robot program ran when a package was recorded."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from gatewayd.rtde.enums import PROGRAM_ADVANCES
from gatewayd.rtde.recipe import Recipe, Scalar

_PROGRAM_RUNNING = 1 << 1
"""Bit of `robot_status_bits`."""


def program_runs(recipe: Recipe) -> Callable[[Sequence[Scalar]], bool] | None:
    """A test of flat values of the recipe; None: it has neither `runtime_state` nor `robot_status_bits`.

    A program runs while `runtime_state` is 2 (playing): what the official reader's `filter_running_program` keeps.
    """
    if "runtime_state" in recipe.slots:
        state = recipe.slots["runtime_state"].start
        return lambda row: row[state] in PROGRAM_ADVANCES
    if "robot_status_bits" in recipe.slots:
        bits = recipe.slots["robot_status_bits"].start
        return lambda row: bool(int(row[bits]) & _PROGRAM_RUNNING)
    return None
