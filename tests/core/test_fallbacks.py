"""Which inputs fall back, and what that leaves to be delivered; tests/core/test_cell_properties.py has the rest."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.core.definition import CellDefinition
from gatewayd.core.delivery import Delivery
from gatewayd.core.events import Event, EventKind
from gatewayd.core.fallbacks import Fallbacks
from gatewayd.core.health import Health
from gatewayd.core.image import ProcessImage, Quality
from gatewayd.core.ownership import LockTable

START, LAMP, PART, FORCE = range(4)
PLC = 0


class Bench:
    def __init__(self, definition: CellDefinition) -> None:
        self.events: list[Event] = []
        self.image = ProcessImage(definition.variables)
        self.ownership = LockTable(definition.locks)
        self.delivery = Delivery(self.image, Health(), self.events.append)
        self.fallbacks = Fallbacks(definition, self.image, self.ownership, self.delivery, self.events.append)
        for index in self.image.inputs:
            self.image.store(index, definition.variables[index].kind.zero, 0.0)
        self.image.values[START] = True


def test_without_the_robot_they_are_owed(press: CellDefinition) -> None:
    bench = Bench(press)
    bench.fallbacks.apply([START], 1.0)
    assert bench.image.values[START] is True
    assert bench.delivery.owed == {START}
    assert bench.fallbacks.due((), over=False) == [START]
    bench.delivery.ready = True
    bench.fallbacks.apply([START, PART], 2.0)
    assert (bench.delivery.owed, bench.delivery.under_way) == (set(), {START}), "part is to be held"
    (event,) = bench.events
    assert (event.kind, event.old, event.new) == (EventKind.FALLBACK, True, False)


def test_who_enters_falls_back_by_policy_where_nobody_owns_it(press: CellDefinition) -> None:
    assert Bench(press).fallbacks.due([START, LAMP, FORCE], over=False) == []
    after = Bench(press)
    assert after.fallbacks.due([START, LAMP, FORCE], over=True) == [START, FORCE], "lamp is clear already"
    always = Bench(replace(press, clear_on_connect=True))
    assert always.fallbacks.due([START, LAMP, FORCE], over=False) == [START, LAMP, FORCE]
    always.ownership.owners[0] = PLC
    always.image.set_available(FORCE, False)
    assert always.fallbacks.due([START, LAMP, FORCE], over=False) == [LAMP]


def test_what_completes_a_word_is_given_and_said(press: CellDefinition) -> None:
    bench = Bench(press)
    bench.fallbacks.complete([PART, FORCE], 1.0)
    assert bench.image.values[PART : FORCE + 1] == [0, 10.0]
    assert bench.image.quality[PART] is Quality.GOOD
    assert [event.new for event in bench.events] == [0, 10.0]
    assert bench.delivery.is_given(PART)
    assert not bench.delivery.under_way
