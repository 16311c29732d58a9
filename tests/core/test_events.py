from __future__ import annotations

from gatewayd.core.events import CAPACITY, Event, EventKind, EventRing


def test_the_ring_forgets_the_oldest_and_goes_on_counting() -> None:
    ring = EventRing()
    for number in range(CAPACITY + 5):
        ring.append(Event(float(number), EventKind.FRESH))
    assert [event.time for event in ring] == [float(number) for number in range(5, CAPACITY + 5)]
    assert (len(ring), ring.count) == (CAPACITY, CAPACITY + 5)


def test_listeners_hear_every_event_once_in_order() -> None:
    ring, heard = EventRing(capacity=1), list[float]()
    ring.listeners.append(lambda event: heard.append(event.time))
    for number in range(3):
        ring.append(Event(float(number), EventKind.FRESH))
    assert heard == [0.0, 1.0, 2.0]


def test_every_kind_has_a_text_of_its_own() -> None:
    assert len({kind.value for kind in EventKind}) == len(EventKind)
