"""The overlay by itself; what the local operator does with it is in test_operator.py."""

from __future__ import annotations

import math

from gatewayd.core.definition import CellDefinition
from gatewayd.core.forcing import Force, Forcing
from gatewayd.core.image import ProcessImage

CYCLES = 6


def test_lift_and_lay_cost_nothing_without_forces(press: CellDefinition) -> None:
    forcing = Forcing(ProcessImage(press.variables))
    forcing.lay()
    forcing.lift()
    assert forcing.due(1e9) == ([], [])
    forcing.put(CYCLES, Force(1, 0.0, 5.0))
    assert forcing.next_due == 5.0
    assert forcing.due(5.0) == ([CYCLES], [])
    assert forcing.next_due == math.inf
