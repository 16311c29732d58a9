"""The overlay by itself; what the local operator does with it is in test_operator.py."""

from __future__ import annotations

import math

from gatewayd.core.definition import CellDefinition
from gatewayd.core.forcing import LOCAL, Force, Forcing, Hold, Holder
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


def test_who_holds_is_known_and_can_be_asked_for(press: CellDefinition) -> None:
    forcing, anna = Forcing(ProcessImage(press.variables)), Holder("anna", "her token")
    forcing.put(CYCLES, Force(1, 0.0, 5.0, anna))
    forcing.hold(0, Hold(math.inf))
    forcing.hold(1, Hold(math.inf, anna))
    assert forcing.holders(1, [CYCLES]) == [anna]
    assert forcing.holders(0, [CYCLES]) == [LOCAL, anna]
    assert forcing.holders(2, []) == []
    assert forcing.of(lambda holder: holder == anna) == ([CYCLES], [1])
    assert (anna.title, Holder("anna").title, LOCAL.title) == ("token anna", "anna", "")
